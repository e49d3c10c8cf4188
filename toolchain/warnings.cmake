# One interface target that carries the flags of our own code: warnings as errors, reproducible arithmetic, sanitizers.
add_library(firstlook_flags INTERFACE)
target_compile_options(firstlook_flags INTERFACE -Wall -Wextra -Wconversion -Wshadow -Werror
                       -ffp-contract=off # the same bits with every optimisation level and compiler
                       -fno-math-errno)
option(FIRSTLOOK_SANITIZE "AddressSanitizer and UndefinedBehaviorSanitizer" OFF)
if(FIRSTLOOK_SANITIZE)
  # AddressSanitizer finds null and freed objects by itself; the checks of each access in UBSan would double the build.
  target_compile_options(firstlook_flags INTERFACE -fsanitize=address,undefined -fno-sanitize-recover=all
                         -fno-sanitize=null,alignment,object-size,vptr
                         -fno-omit-frame-pointer
                         -Wno-maybe-uninitialized) # g++ 12 sees it falsely in <regex> when it instruments
  target_link_options(firstlook_flags INTERFACE -fsanitize=address,undefined)
endif()
