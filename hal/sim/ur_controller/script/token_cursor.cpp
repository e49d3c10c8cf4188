#include "hal/sim/ur_controller/script/token_cursor.hpp"

namespace firstlook::sim::ur::script {
namespace {

using Kind = Token::Kind;

constexpr int kNestingMax = 100;

}  // namespace

bool TokenCursor::accept(std::string_view symbol) {
  if (!now().is(symbol)) return false;
  advance();
  return true;
}

std::string TokenCursor::expect_name() {
  if (now().kind != Kind::kName) {
    fail_here();
    return {};
  }
  std::string name = now().text;
  advance();
  return name;
}

std::string TokenCursor::expect_member() {
  if (is_keyword(now().text)) fail_here();
  return expect_name();
}

void TokenCursor::end_statement() {
  if (failed() || now().kind == Kind::kEnd || now().kind == Kind::kName) return;
  if (now().kind != Kind::kLineEnd) return fail_here();
  advance();
}

void TokenCursor::enter() {
  if (++nesting_ > kNestingMax) fail_here();
}

void TokenCursor::fail(ScriptError error) {
  if (!error_) error_ = std::move(error);
  at_ = tokens_.size() - 1;
}

}  // namespace firstlook::sim::ur::script
