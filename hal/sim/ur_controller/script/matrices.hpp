/// Linear algebra with lists of rows, as URScript has it.
#pragma once

#include "hal/sim/ur_controller/script/operations.hpp"

namespace firstlook::sim::ur::script {

/// Of a list of lists with as many elements each; 0 for what is none.
[[nodiscard]] std::size_t columns_of(const Value& value);
/// Numbers in all of them.
[[nodiscard]] bool is_matrix(const Value& value);

/// How many numbers a * b multiplies, where one is a matrix and both are lists; else 0.
[[nodiscard]] std::size_t products_of(const Value& a, const Value& b);
/// Matrix with matrix, or matrix with list. Integers stay integers of 32 bits.
[[nodiscard]] Computed matrix_product(const Value& a, const Value& b);
[[nodiscard]] Computed inverse_of_matrix(const Value& matrix);
[[nodiscard]] Computed transpose_of(const Value& matrix);

}  // namespace firstlook::sim::ur::script
