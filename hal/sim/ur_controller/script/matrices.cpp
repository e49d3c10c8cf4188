#include "hal/sim/ur_controller/script/matrices.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>

namespace firstlook::sim::ur::script {
namespace {

constexpr std::size_t kProductsMax = 200'000;
constexpr Eigen::Index kInverseSizeMax = 50;
constexpr double kSingular = 1e-13;  // of a matrix whose rows have been scaled to 1

/// Sums of them wrap around, as integers of 32 bits do.
using Integers = Eigen::Matrix<std::uint64_t, Eigen::Dynamic, Eigen::Dynamic>;

bool all_numbers(const List& list) { return !list.empty() && std::ranges::all_of(list, &Value::is_number); }
bool all_integers(const List& list) {
  return std::ranges::all_of(list, [](const Value& v) { return v.as<std::int64_t>() != nullptr; });
}

template <typename Number>
Number number(const Value& value) {
  if constexpr (std::is_same_v<Number, double>) return value.number();
  return static_cast<Number>(*value.as<std::int64_t>());
}

/// A matrix, or a list as one column.
template <typename Number>
Eigen::Matrix<Number, Eigen::Dynamic, Eigen::Dynamic> eigen(const Value& value) {
  const List& rows = *value.as<List>();
  const std::size_t columns = columns_of(value);
  Eigen::Matrix<Number, Eigen::Dynamic, Eigen::Dynamic> matrix(rows.size(), std::max<std::size_t>(1, columns));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const List* row = rows[i].as<List>();
    for (std::size_t j = 0; j < std::max<std::size_t>(1, columns); ++j) {
      const Value& element = row != nullptr ? (*row)[j] : rows[i];
      matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = number<Number>(element);
    }
  }
  return matrix;
}

Value value_of(double number) { return number; }
Value value_of(std::uint64_t number) { return static_cast<std::int64_t>(static_cast<std::int32_t>(number)); }

template <typename Matrix>
Value list_of_rows(const Matrix& matrix, bool one_column) {
  List rows;
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    List row;
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) row.push_back(value_of(matrix(i, j)));
    rows.push_back(one_column ? std::move(row.front()) : Value(std::move(row)));
  }
  return rows;
}

bool has_integers(const Value& value) {
  const List& rows = *value.as<List>();
  return columns_of(value) == 0
             ? all_integers(rows)
             : std::ranges::all_of(rows, [](const Value& row) { return all_integers(*row.as<List>()); });
}

}  // namespace

std::size_t columns_of(const Value& value) {
  const List* rows = value.as<List>();
  const List* first = rows != nullptr && !rows->empty() ? rows->front().as<List>() : nullptr;
  if (first == nullptr) return 0;
  const bool even = std::ranges::all_of(
      *rows, [&](const Value& row) { return row.as<List>() != nullptr && row.as<List>()->size() == first->size(); });
  return even ? first->size() : 0;
}

bool is_matrix(const Value& value) {
  return columns_of(value) > 0 &&
         std::ranges::all_of(*value.as<List>(), [](const Value& row) { return all_numbers(*row.as<List>()); });
}

std::size_t products_of(const Value& a, const Value& b) {
  if (a.as<List>() == nullptr || b.as<List>() == nullptr || !(is_matrix(a) || is_matrix(b))) return 0;
  return a.as<List>()->size() * b.as<List>()->size() * std::max<std::size_t>(1, columns_of(b));
}

Computed matrix_product(const Value& a, const Value& b) {
  if (!is_matrix(a) || !(is_matrix(b) || all_numbers(*b.as<List>()))) {
    return std::unexpected("Type error: a product is of two matrices, or of a matrix and a list");
  }
  const std::size_t rows = b.as<List>()->size();
  if (columns_of(a) != rows) {
    return std::unexpected(fmt::format("Matrices do not fit: {} columns and {} rows", columns_of(a), rows));
  }
  if (products_of(a, b) > kProductsMax) return std::unexpected("Matrices too large to be multiplied");
  const bool list = columns_of(b) == 0;
  if (has_integers(a) && has_integers(b)) {
    return list_of_rows(Integers(eigen<std::uint64_t>(a) * eigen<std::uint64_t>(b)), list);
  }
  return list_of_rows(Eigen::MatrixXd(eigen<double>(a) * eigen<double>(b)), list);
}

Computed inverse_of_matrix(const Value& matrix) {
  const auto size = static_cast<Eigen::Index>(columns_of(matrix));
  if (!is_matrix(matrix) || std::ssize(*matrix.as<List>()) != size || size > kInverseSizeMax) {
    return std::unexpected("Type error: not a square matrix of up to 50 rows");
  }
  Eigen::MatrixXd rows = eigen<double>(matrix);
  const Eigen::VectorXd scale = rows.rowwise().lpNorm<Eigen::Infinity>();
  if (!rows.allFinite() || scale.minCoeff() <= 0) return std::unexpected("The matrix has no inverse");
  for (Eigen::Index i = 0; i < size; ++i) rows.row(i) /= scale[i];
  Eigen::FullPivLU<Eigen::MatrixXd> lu(rows);
  lu.setThreshold(kSingular);
  if (!lu.isInvertible()) return std::unexpected("The matrix has no inverse");
  Eigen::MatrixXd inverse = lu.inverse();
  for (Eigen::Index j = 0; j < size; ++j) inverse.col(j) /= scale[j];
  return list_of_rows(inverse, false);
}

Computed transpose_of(const Value& matrix) {
  const std::size_t count = columns_of(matrix);
  if (count == 0) return std::unexpected("Type error: not a matrix");
  List columns;
  for (std::size_t j = 0; j < count; ++j) {
    List column;
    for (const Value& row : *matrix.as<List>()) column.push_back((*row.as<List>())[j]);
    columns.emplace_back(std::move(column));
  }
  return Value(std::move(columns));
}

}  // namespace firstlook::sim::ur::script
