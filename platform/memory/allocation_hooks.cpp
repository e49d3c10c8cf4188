// The program's malloc and its kin. They stand in front of glibc's for every library, because a symbol of the program
// comes before those of shared libraries; glibc's own are reached by their second names. seal() asks
// counts_malloc(), so linking the guard from a library links this file, too.
#include <malloc.h>

#include <bit>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <new>

#include "platform/memory/allocation_guard.hpp"
#include "platform/memory/heap_gate.hpp"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define FIRSTLOOK_SANITIZER_OWNS_MALLOC 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define FIRSTLOOK_SANITIZER_OWNS_MALLOC 1
#endif
#endif

namespace gate = firstlook::memory::heap_gate;

#ifndef FIRSTLOOK_SANITIZER_OWNS_MALLOC

bool firstlook::memory::counts_malloc() { return true; }

extern "C" {

// NOLINTBEGIN(bugprone-reserved-identifier): glibc's own names for what is replaced here
void* __libc_malloc(std::size_t size) noexcept;
void* __libc_calloc(std::size_t count, std::size_t size) noexcept;
void* __libc_realloc(void* block, std::size_t size) noexcept;
void* __libc_memalign(std::size_t alignment, std::size_t size) noexcept;
void __libc_free(void* block) noexcept;
// NOLINTEND(bugprone-reserved-identifier)

void* malloc(std::size_t size) noexcept {
  if (!gate::admit(size)) {
    errno = ENOMEM;
    return nullptr;
  }
  void* const block = __libc_malloc(size);
  if (gate::counts_frees()) gate::settle(size, block == nullptr ? 0 : malloc_usable_size(block));
  return block;
}

void* calloc(std::size_t count, std::size_t size) noexcept {
  std::size_t bytes = 0;
  if (__builtin_mul_overflow(count, size, &bytes) || !gate::admit(bytes)) {
    errno = ENOMEM;
    return nullptr;
  }
  void* const block = __libc_calloc(count, size);
  if (gate::counts_frees()) gate::settle(bytes, block == nullptr ? 0 : malloc_usable_size(block));
  return block;
}

void free(void* block) noexcept {
  if (block != nullptr && gate::counts_frees()) gate::freed(malloc_usable_size(block));
  __libc_free(block);
}

void* realloc(void* old_block, std::size_t size) noexcept {
  if (old_block == nullptr) return malloc(size);
  if (size == 0) {
    free(old_block);
    return nullptr;
  }
  const std::size_t old_bytes = gate::counts_frees() ? malloc_usable_size(old_block) : 0;
  // Both blocks may exist for a moment, so the whole new one has to be admitted. The old size is read before.
  if (!gate::admit(size)) {
    errno = ENOMEM;
    return nullptr;
  }
  void* const block = __libc_realloc(old_block, size);
  if (gate::counts_frees()) {
    gate::settle(size, block == nullptr ? 0 : malloc_usable_size(block));
    if (block != nullptr) gate::freed(old_bytes);
  }
  return block;
}

void* memalign(std::size_t alignment, std::size_t size) noexcept {
  if (!gate::admit(size)) {
    errno = ENOMEM;
    return nullptr;
  }
  void* const block = __libc_memalign(alignment, size);
  if (gate::counts_frees()) gate::settle(size, block == nullptr ? 0 : malloc_usable_size(block));
  return block;
}

void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept { return memalign(alignment, size); }

int posix_memalign(void** result, std::size_t alignment, std::size_t size) noexcept {
  if (!std::has_single_bit(alignment) || alignment % sizeof(void*) != 0) return EINVAL;
  void* const block = memalign(alignment, size);
  if (block == nullptr) return ENOMEM;
  *result = block;
  return 0;
}

}  // extern "C"

#else

bool firstlook::memory::counts_malloc() { return false; }

namespace {

void* counted(std::size_t size, std::size_t alignment) noexcept {
  if (!gate::admit(size)) return nullptr;
  void* const block = alignment <= alignof(std::max_align_t)
                          ? std::malloc(size == 0 ? 1 : size)
                          : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (gate::counts_frees()) gate::settle(size, block == nullptr ? 0 : malloc_usable_size(block));
  return block;
}

void* counted_or_throw(std::size_t size, std::size_t alignment) {
  void* const block = counted(size, alignment);
  if (block == nullptr) throw std::bad_alloc();
  return block;
}

void counted_free(void* block) noexcept {
  if (block != nullptr && gate::counts_frees()) gate::freed(malloc_usable_size(block));
  std::free(block);
}

}  // namespace

void* operator new(std::size_t size) { return counted_or_throw(size, 1); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return counted_or_throw(size, static_cast<std::size_t>(alignment));
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return counted(size, 1); }
void* operator new(std::size_t size, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return counted(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size) { return counted_or_throw(size, 1); }
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return counted_or_throw(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return counted(size, 1); }
void* operator new[](std::size_t size, std::align_val_t alignment, const std::nothrow_t&) noexcept {
  return counted(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* block) noexcept { counted_free(block); }
void operator delete(void* block, std::size_t) noexcept { counted_free(block); }
void operator delete(void* block, std::align_val_t) noexcept { counted_free(block); }
void operator delete(void* block, std::size_t, std::align_val_t) noexcept { counted_free(block); }
void operator delete[](void* block) noexcept { counted_free(block); }
void operator delete[](void* block, std::size_t) noexcept { counted_free(block); }
void operator delete[](void* block, std::align_val_t) noexcept { counted_free(block); }
void operator delete[](void* block, std::size_t, std::align_val_t) noexcept { counted_free(block); }

#endif
