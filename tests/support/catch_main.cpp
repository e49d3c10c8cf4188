#define CATCH_CONFIG_MAIN
#include <catch2/catch.hpp>

/// Read by LeakSanitizer, where there is one. Ceres loses what it holds when an allocation fails in the middle of a
/// solve, which tests of failing allocations make happen on purpose; what our own code loses is still reported.
extern "C" const char* __lsan_default_suppressions();  // NOLINT(bugprone-reserved-identifier)
extern "C" const char* __lsan_default_suppressions() { return "leak:ceres::internal"; }
