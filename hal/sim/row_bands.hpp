/// Rows of an image, shared out among the threads of a pool.
#pragma once

#include <algorithm>

#include "platform/loop/worker_pool.hpp"

namespace firstlook::sim {

inline constexpr int kBandRows = 16;

/// Calls body(first, last) for bands of rows that together are 0 .. rows-1, last excluded; on the caller's thread when
/// there is no pool. Bands come in no particular order: each writes its own rows only.
template <typename Body>
void for_row_bands(WorkerPool* pool, int rows, Body body) {
  const auto band = [&](int index, int) { body(index * kBandRows, std::min(rows, (index + 1) * kBandRows)); };
  const int bands = (rows + kBandRows - 1) / kBandRows;
  if (pool != nullptr) {
    pool->parallel_for(bands, band);
  } else {
    for (int index = 0; index < bands; ++index) band(index, 0);
  }
}

}  // namespace firstlook::sim
