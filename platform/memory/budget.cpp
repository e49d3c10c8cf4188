#include "platform/memory/budget.hpp"

#include <atomic>

#include "platform/core/ensure.hpp"

namespace firstlook::memory {
namespace {

struct PoolAccount {
  std::atomic<std::size_t> now{0};
  std::atomic<std::size_t> peak{0};
};
std::array<PoolAccount, kBudget.size()> g_accounts;

PoolAccount& account_of(Pool pool) { return g_accounts[static_cast<std::size_t>(pool)]; }

void raise_to(std::atomic<std::size_t>& peak, std::size_t value) {
  std::size_t seen = peak.load();
  while (seen < value && !peak.compare_exchange_weak(seen, value)) {
  }
}

}  // namespace

Status account(Pool pool, std::size_t bytes) {
  const BudgetRow& row = budget_row(pool);
  PoolAccount& pool_account = account_of(pool);
  std::size_t taken = pool_account.now.load();
  do {
    if (bytes > row.bytes() - taken) {
      return failure(Fault::kOutOfMemory, "{}: {} bytes asked, {} of {} bytes taken", row.name, bytes, taken,
                     row.bytes());
    }
  } while (!pool_account.now.compare_exchange_weak(taken, taken + bytes));
  raise_to(pool_account.peak, taken + bytes);
  return {};
}

void release(Pool pool, std::size_t bytes) {
  const std::size_t before = account_of(pool).now.fetch_sub(bytes);
  ENSURE(1301, before >= bytes);
}

Status account_standing_rows() {
  for (const BudgetRow& row : kBudget) {
    if (!is_standing(row.pool)) continue;
    if (Status status = account(row.pool, row.bytes()); !status) return status;
  }
  return {};
}

std::size_t accounted_bytes(Pool pool) { return account_of(pool).now.load(); }
std::size_t peak_bytes(Pool pool) { return account_of(pool).peak.load(); }

std::size_t peak_bytes() {
  std::size_t total = 0;
  for (const PoolAccount& pool_account : g_accounts) total += pool_account.peak.load();
  return total;
}

void reset_accounts() {
  for (PoolAccount& pool_account : g_accounts) {
    pool_account.now = 0;
    pool_account.peak = 0;
  }
}

Result<PoolShare> PoolShare::take(Pool pool, std::size_t bytes) {
  if (Status status = account(pool, bytes); !status) return std::unexpected(status.error());
  return PoolShare(pool, bytes);
}

}  // namespace firstlook::memory
