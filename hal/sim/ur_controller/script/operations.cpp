#include "hal/sim/ur_controller/script/operations.hpp"

#include <fmt/format.h>

#include <cmath>

#include "hal/sim/ur_controller/script/matrices.hpp"

namespace firstlook::sim::ur::script {
namespace {

std::unexpected<std::string> type_error(std::string_view what, const Value& a, const Value& b) {
  return std::unexpected(fmt::format("Type error: cannot {} {} and {}", what, type_name(a), type_name(b)));
}

bool integers(const Value& a, const Value& b) {
  return a.as<std::int64_t>() != nullptr && b.as<std::int64_t>() != nullptr;
}

/// Integers have 32 bits and wrap around.
Value wrapped(std::uint64_t value) { return static_cast<std::int64_t>(static_cast<std::int32_t>(value)); }

Computed arithmetic(BinaryOp op, const Value& a, const Value& b) {
  const double x = a.number(), y = b.number();
  if (op == BinaryOp::kDivide || op == BinaryOp::kModulo) {
    if (y == 0) return std::unexpected("Division by zero");
    if (op == BinaryOp::kDivide) return Value(x / y);
    if (integers(a, b) && y == -1) return wrapped(0);
    if (integers(a, b)) return wrapped(static_cast<std::uint64_t>(*a.as<std::int64_t>() % *b.as<std::int64_t>()));
    return Value(std::fmod(x, y));
  }
  if (integers(a, b)) {
    const auto i = static_cast<std::uint64_t>(*a.as<std::int64_t>()),
               j = static_cast<std::uint64_t>(*b.as<std::int64_t>());
    return wrapped(op == BinaryOp::kAdd ? i + j : op == BinaryOp::kSubtract ? i - j : i * j);
  }
  return Value(op == BinaryOp::kAdd ? x + y : op == BinaryOp::kSubtract ? x - y : x * y);
}

Computed combined(BinaryOp op, const Value& a, const Value& b);

/// Lists of one length are added and subtracted element by element, and multiplied with numbers.
Computed elementwise(BinaryOp op, const Value& a, const Value& b) {
  const List* x = a.as<List>();
  const List* y = b.as<List>();
  if (x != nullptr && y != nullptr && x->size() != y->size()) {
    return std::unexpected("Lists of different lengths");
  }
  const std::size_t count = x != nullptr ? x->size() : y->size();
  List result;
  for (std::size_t i = 0; i < count; ++i) {
    Computed element = combined(op, x != nullptr ? (*x)[i] : a, y != nullptr ? (*y)[i] : b);
    if (!element) return element;
    result.push_back(std::move(*element));
  }
  return Value(std::move(result));
}

/// Numbers, or lists element by element.
Computed combined(BinaryOp op, const Value& a, const Value& b) {
  if (a.is_number() && b.is_number()) return arithmetic(op, a, b);
  const bool lists = a.as<List>() != nullptr || b.as<List>() != nullptr;
  const bool fitting = (a.as<List>() != nullptr || a.is_number()) && (b.as<List>() != nullptr || b.is_number());
  if (lists && fitting) return elementwise(op, a, b);
  return type_error("combine", a, b);
}

Computed ordered(BinaryOp op, const Value& a, const Value& b) {
  if (!a.is_number() || !b.is_number()) return type_error("compare", a, b);
  const double x = a.number(), y = b.number();
  switch (op) {
    case BinaryOp::kLess:
      return Value(x < y);
    case BinaryOp::kLessOrEqual:
      return Value(x <= y);
    case BinaryOp::kGreater:
      return Value(x > y);
    default:
      return Value(x >= y);
  }
}

}  // namespace

Computed binary(BinaryOp op, const Value& a, const Value& b) {
  switch (op) {
    case BinaryOp::kEqual:
      return Value(equal(a, b));
    case BinaryOp::kNotEqual:
      return Value(!equal(a, b));
    case BinaryOp::kXor:
      if (a.as<bool>() == nullptr || b.as<bool>() == nullptr) return type_error("xor", a, b);
      return Value(*a.as<bool>() != *b.as<bool>());
    case BinaryOp::kLess:
    case BinaryOp::kLessOrEqual:
    case BinaryOp::kGreater:
    case BinaryOp::kGreaterOrEqual:
      return ordered(op, a, b);
    default:
      break;
  }
  if (op == BinaryOp::kMultiply && products_of(a, b) > 0) return matrix_product(a, b);
  return combined(op, a, b);
}

Computed negate(const Value& value) {
  if (const auto* i = value.as<std::int64_t>()) return wrapped(-static_cast<std::uint64_t>(*i));
  if (const auto* d = value.as<double>()) return Value(-*d);
  if (value.as<List>() != nullptr) return binary(BinaryOp::kMultiply, value, Value(std::int64_t{-1}));
  return std::unexpected(fmt::format("Type error: cannot negate {}", type_name(value)));
}

}  // namespace firstlook::sim::ur::script
