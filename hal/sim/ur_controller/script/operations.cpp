#include "hal/sim/ur_controller/script/operations.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace firstlook::sim::ur::script {
namespace {

constexpr std::size_t kProductsMax = 200'000;  // of numbers, for a product of matrices

std::unexpected<std::string> type_error(std::string_view what, const Value& a, const Value& b) {
  return std::unexpected(fmt::format("Type error: cannot {} {} and {}", what, type_name(a), type_name(b)));
}

bool integers(const Value& a, const Value& b) {
  return a.as<std::int64_t>() != nullptr && b.as<std::int64_t>() != nullptr;
}

/// Integers have 32 bits and wrap around.
Value wrapped(std::int64_t value) { return static_cast<std::int64_t>(static_cast<std::int32_t>(value)); }

Computed arithmetic(BinaryOp op, const Value& a, const Value& b) {
  const double x = a.number(), y = b.number();
  if (op == BinaryOp::kDivide || op == BinaryOp::kModulo) {
    if (y == 0) return std::unexpected("Division by zero");
    if (op == BinaryOp::kDivide) return Value(x / y);
    if (integers(a, b)) return wrapped(*a.as<std::int64_t>() % *b.as<std::int64_t>());
    return Value(std::fmod(x, y));
  }
  if (integers(a, b)) {
    const std::int64_t i = *a.as<std::int64_t>(), j = *b.as<std::int64_t>();
    return wrapped(op == BinaryOp::kAdd ? i + j : op == BinaryOp::kSubtract ? i - j : i * j);
  }
  return Value(op == BinaryOp::kAdd ? x + y : op == BinaryOp::kSubtract ? x - y : x * y);
}

bool is_vector(const Value& value) {
  const List* list = value.as<List>();
  return list != nullptr && !list->empty() && std::ranges::all_of(*list, &Value::is_number);
}

bool is_matrix(const Value& value) { return matrix_columns(value) > 0; }

/// The sum of what rows and columns hold, multiplied in pairs.
Computed dot(const List& row, const Value& column, std::optional<std::size_t> j) {
  Value sum{std::int64_t{0}};
  const List& rows = *column.as<List>();
  for (std::size_t k = 0; k < row.size(); ++k) {
    Computed product = arithmetic(BinaryOp::kMultiply, row[k], j ? (*rows[k].as<List>())[*j] : rows[k]);
    if (product) product = arithmetic(BinaryOp::kAdd, sum, *product);
    if (!product) return product;
    sum = std::move(*product);
  }
  return sum;
}

/// Matrix with matrix, or matrix with list.
Computed matrix_product(const Value& a, const Value& b) {
  if (!is_matrix(a) || !(is_matrix(b) || is_vector(b))) {
    return std::unexpected("Type error: a product is of two matrices, or of a matrix and a list");
  }
  const std::size_t inner = b.as<List>()->size(), columns = matrix_columns(b);
  if (matrix_columns(a) != inner) {
    return std::unexpected(fmt::format("Matrices do not fit: {} columns and {} rows", matrix_columns(a), inner));
  }
  if (a.as<List>()->size() * inner * std::max<std::size_t>(1, columns) > kProductsMax) {
    return std::unexpected("Matrices too large to be multiplied");
  }
  List result;
  for (const Value& row_value : *a.as<List>()) {
    const List& row = *row_value.as<List>();
    List row_of_result;
    for (std::size_t j = 0; j < std::max<std::size_t>(1, columns); ++j) {
      Computed element = dot(row, b, columns > 0 ? std::optional(j) : std::nullopt);
      if (!element) return element;
      row_of_result.push_back(std::move(*element));
    }
    result.push_back(columns > 0 ? Value(std::move(row_of_result)) : std::move(row_of_result.front()));
  }
  return Value(std::move(result));
}

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
    Computed element = binary(op, x != nullptr ? (*x)[i] : a, y != nullptr ? (*y)[i] : b);
    if (!element) return element;
    result.push_back(std::move(*element));
  }
  return Value(std::move(result));
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

/// Where in the container the index leads. Error: nowhere.
std::expected<std::size_t, std::string> place(const Value& container, const Value& index) {
  if (const List* list = container.as<List>()) return index_within(index, list->size());
  if (const PoseValue* pose = container.as<PoseValue>()) return index_within(index, pose->pose.size());
  const StructValue* members = container.as<StructValue>();
  if (members == nullptr) {
    const bool member = index.as<std::string>() != nullptr;
    return std::unexpected(
        fmt::format("Type error: {} has no {}", type_name(container), member ? "members" : "elements"));
  }
  const auto* name = index.as<std::string>();
  if (name == nullptr) return index_within(index, members->values.size());
  const auto found = std::ranges::find(members->names, *name);
  if (found == members->names.end()) return std::unexpected(fmt::format("The struct has no member {}", *name));
  return static_cast<std::size_t>(found - members->names.begin());
}

}  // namespace

std::expected<std::size_t, std::string> index_within(const Value& index, std::size_t size) {
  const auto* i = index.as<std::int64_t>();
  if (i == nullptr) return std::unexpected(fmt::format("Type error: index is {}", type_name(index)));
  if (*i < 0 || static_cast<std::size_t>(*i) >= size) {
    return std::unexpected(fmt::format("Index out of bounds: {} of {}", *i, size));
  }
  return static_cast<std::size_t>(*i);
}

std::size_t matrix_columns(const Value& value) {
  const List* rows = value.as<List>();
  const List* first = rows != nullptr && !rows->empty() ? rows->front().as<List>() : nullptr;
  if (first == nullptr) return 0;
  const bool matrix = std::ranges::all_of(*rows, [&](const Value& element) {
    const List* row = element.as<List>();
    return row != nullptr && row->size() == first->size() && std::ranges::all_of(*row, &Value::is_number);
  });
  return matrix ? first->size() : 0;
}

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
  if (a.is_number() && b.is_number()) return arithmetic(op, a, b);
  const bool lists = a.as<List>() != nullptr || b.as<List>() != nullptr;
  const bool fitting = (a.as<List>() != nullptr || a.is_number()) && (b.as<List>() != nullptr || b.is_number());
  if (op == BinaryOp::kMultiply && (is_matrix(a) || is_matrix(b)) && a.as<List>() != nullptr &&
      b.as<List>() != nullptr) {
    return matrix_product(a, b);
  }
  if (lists && fitting) return elementwise(op, a, b);
  return type_error("combine", a, b);
}

Computed negate(const Value& value) {
  if (const auto* i = value.as<std::int64_t>()) return wrapped(-*i);
  if (const auto* d = value.as<double>()) return Value(-*d);
  if (value.as<List>() != nullptr) return binary(BinaryOp::kMultiply, value, Value(std::int64_t{-1}));
  return std::unexpected(fmt::format("Type error: cannot negate {}", type_name(value)));
}

Computed element_of(const Value& container, std::span<const Value> path) {
  const Value* at = &container;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const auto found = place(*at, path[i]);
    if (!found) return std::unexpected(found.error());
    if (const PoseValue* pose = at->as<PoseValue>()) {
      if (i + 1 < path.size()) return std::unexpected("Type error: float has no elements");
      return Value(pose->pose[*found]);
    }
    const List* list = at->as<List>();
    at = list != nullptr ? &(*list)[*found] : &at->as<StructValue>()->values[*found];
  }
  return *at;
}

Computed with_element(Value container, std::span<const Value> path, const Value& element) {
  if (path.empty()) return assigned(container, element);
  const auto at = place(container, path[0]);
  if (!at) return std::unexpected(at.error());
  if (PoseValue* pose = container.as<PoseValue>()) {
    if (!element.is_number() || path.size() > 1) return type_error("set an element of", container, element);
    pose->pose[*at] = element.number();
    return container;
  }
  List* list = container.as<List>();
  StructValue* members = container.as<StructValue>();
  Value& inner = list != nullptr ? (*list)[*at] : members->values[*at];
  const bool member = members != nullptr && path.size() == 1;
  if (member && !alike(inner, element)) {
    return std::unexpected(
        fmt::format("Type error: member {} is {}, not {}", members->names[*at], type_name(inner), type_name(element)));
  }
  Computed changed = with_element(std::move(inner), path.subspan(1), element);
  if (!changed) return changed;
  inner = std::move(*changed);
  // Their weight is a new one.
  return list != nullptr ? with_capacity(std::move(*list), container.capacity) : Value(std::move(*members));
}

Value with_capacity(List list, std::uint32_t capacity) {
  Value value(std::move(list));
  value.capacity = std::max(value.capacity, capacity);
  return value;
}

Value assigned(const Value& before, Value value) {
  const List* list = before.as<List>();
  StructValue* members = value.as<StructValue>();
  if (list == nullptr) return value;
  if (members != nullptr && !members->values.empty()) {
    const Value& kind = list->empty() ? members->values.front() : list->front();
    if (!std::ranges::all_of(members->values, [&](const Value& v) { return alike(v, kind); })) return value;
    value = Value(std::move(members->values));
  }
  if (value.as<List>() != nullptr && value.as<List>()->size() <= before.capacity) value.capacity = before.capacity;
  return value;
}

}  // namespace firstlook::sim::ur::script
