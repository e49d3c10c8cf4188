#include "platform/core/fault_table.hpp"

#include <array>

namespace firstlook {
namespace {
constexpr std::array kRows = {
#define FIRSTLOOK_FAULT_ROW(name, code, severity, text, remedy) \
  FaultRow{Fault::name, Severity::severity, #name, text, remedy},
    FIRSTLOOK_FAULTS(FIRSTLOOK_FAULT_ROW)
#undef FIRSTLOOK_FAULT_ROW
};
}  // namespace

std::span<const FaultRow> fault_table() { return kRows; }

const FaultRow& fault_row(Fault fault) {
  for (const FaultRow& row : kRows) {
    if (row.fault == fault) return row;
  }
  return kRows.front();
}

std::optional<FaultRow> find_fault(int code) {
  for (const FaultRow& row : kRows) {
    if (static_cast<int>(row.fault) == code) return row;
  }
  return std::nullopt;
}

}  // namespace firstlook
