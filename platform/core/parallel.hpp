/// How a pure function asks its caller to spread work over threads, without knowing of threads.
#pragma once

#include "platform/core/function_ref.hpp"

namespace firstlook {

/// body(index, worker): worker is 0 .. workers - 1, and no two calls at one time have the same.
using IndexedBody = FunctionRef<void(int index, int worker)>;

/// run(n, body) calls body once for each index in [0, n), in any order and on any of its workers, and returns when all
/// are done. Results must not depend on the number of workers: each index writes to its own place.
using RunParallel = FunctionRef<void(int n, IndexedBody body)>;

/// RunParallel on the calling thread alone.
inline constexpr auto run_serially = [](int n, IndexedBody body) {
  for (int i = 0; i < n; ++i) body(i, 0);
};

}  // namespace firstlook
