# Headers that most sources read, read once for each target: off in release builds, which thereby prove that each file
# includes what it uses; on where the sanitizers make every build a long one.
option(FIRSTLOOK_PRECOMPILE "Precompile the headers of the standard library, Eigen and fmt" OFF)
function(firstlook_precompile target)
  if(FIRSTLOOK_PRECOMPILE)
    target_precompile_headers(${target} PRIVATE <Eigen/Dense> <fmt/format.h> <algorithm> <expected> <functional> <map>
                              <optional> <string> <vector> ${ARGN})
  endif()
endfunction()
