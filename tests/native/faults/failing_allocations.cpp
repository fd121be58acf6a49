#include "faults/failing_allocations.h"

#include <execinfo.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <new>
#include <unordered_map>
#include <utility>

namespace {

constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

std::atomic<std::int64_t> allocations{0};
std::atomic<std::int64_t> live{0};
std::atomic<std::int64_t> first_to_fail{kNever};
std::atomic<std::int64_t> last_to_fail{kNever};

// From where allocations were made: the hash of the stack -> the first and the last one.
using Places = std::unordered_map<std::uint64_t, std::pair<std::int64_t, std::int64_t>>;
Places places;
thread_local bool noting = false;  // on this thread, and not for the notes themselves

void note(std::int64_t number) {
  noting = false;
  constexpr int kFrames = 12;
  void* frames[kFrames];
  const int count = backtrace(frames, kFrames);
  std::uint64_t hash = 1469598103934665603U;  // FNV-1a, by words
  for (int i = 0; i < count; ++i)
    hash = (hash ^ reinterpret_cast<std::uintptr_t>(frames[i])) * 1099511628211U;
  places.try_emplace(hash, number, number).first->second.second = number;
  allocations = number - 1;  // the notes themselves do not count
  noting = true;
}

bool fails() {
  if (noting) note(allocations + 1);
  const std::int64_t number = ++allocations;
  return number >= first_to_fail && number <= last_to_fail;
}

void* counted(void* block) {
  if (block != nullptr) ++live;
  return block;
}

}  // namespace

// What CGAL loses when memory runs out (see Call::may_lose_blocks).
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:CGAL::Compact_container\n"; }

// What the linker makes of malloc and its kin: __wrap_malloc is called, __real_malloc is malloc.
extern "C" {
void* __real_malloc(std::size_t size);
void* __real_calloc(std::size_t count, std::size_t size);
void* __real_realloc(void* block, std::size_t size);
int __real_posix_memalign(void** block, std::size_t alignment, std::size_t size);
void* __real_aligned_alloc(std::size_t alignment, std::size_t size);
void __real_free(void* block);

void* __wrap_malloc(std::size_t size) { return fails() ? nullptr : counted(__real_malloc(size)); }
void* __wrap_calloc(std::size_t count, std::size_t size) {
  return fails() ? nullptr : counted(__real_calloc(count, size));
}
void* __wrap_realloc(void* block, std::size_t size) {
  if (fails()) return nullptr;
  void* moved = __real_realloc(block, size);
  if (block == nullptr) counted(moved);
  return moved;
}
int __wrap_posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  constexpr int kNoMemory = 12;  // ENOMEM
  if (fails()) return kNoMemory;
  const int error = __real_posix_memalign(block, alignment, size);
  if (error == 0) counted(*block);
  return error;
}
void* __wrap_aligned_alloc(std::size_t alignment, std::size_t size) {
  return fails() ? nullptr : counted(__real_aligned_alloc(alignment, size));
}
void __wrap_free(void* block) {
  if (block != nullptr) --live;
  __real_free(block);
}
}

namespace {

void* allocate(std::size_t size) { return __wrap_malloc(size == 0 ? 1 : size); }
void* allocate(std::size_t size, std::align_val_t alignment) {
  const auto unit = static_cast<std::size_t>(alignment);
  return __wrap_aligned_alloc(unit, (size + unit - 1) / unit * unit);
}
void* or_throw(void* block) {
  if (block == nullptr) throw std::bad_alloc();
  return block;
}

}  // namespace

void* operator new(std::size_t size) { return or_throw(allocate(size)); }
void* operator new[](std::size_t size) { return or_throw(allocate(size)); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return allocate(size); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return allocate(size); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return or_throw(allocate(size, alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return or_throw(allocate(size, alignment));
}
void operator delete(void* block) noexcept { __wrap_free(block); }
void operator delete[](void* block) noexcept { __wrap_free(block); }
void operator delete(void* block, std::size_t) noexcept { __wrap_free(block); }
void operator delete[](void* block, std::size_t) noexcept { __wrap_free(block); }
void operator delete(void* block, const std::nothrow_t&) noexcept { __wrap_free(block); }
void operator delete[](void* block, const std::nothrow_t&) noexcept { __wrap_free(block); }
void operator delete(void* block, std::align_val_t) noexcept { __wrap_free(block); }
void operator delete[](void* block, std::align_val_t) noexcept { __wrap_free(block); }
void operator delete(void* block, std::size_t, std::align_val_t) noexcept { __wrap_free(block); }
void operator delete[](void* block, std::size_t, std::align_val_t) noexcept { __wrap_free(block); }

namespace flipfree::test {

FailingAllocations::FailingAllocations(std::int64_t at, bool and_all_later) {
  allocations = 0;
  last_to_fail = and_all_later ? kNever : at;
  first_to_fail = at == 0 ? kNever : at;
}
FailingAllocations::~FailingAllocations() {
  first_to_fail = kNever;
  last_to_fail = kNever;
}
std::int64_t FailingAllocations::count() const { return allocations; }

AllocationPlaces::AllocationPlaces() {
  void* frame[1];
  backtrace(frame, 1);  // the first one loads a library
  allocations = 0;
  noting = true;
}
AllocationPlaces::~AllocationPlaces() {
  noting = false;
  places = {};
}
std::vector<std::int64_t> AllocationPlaces::numbers() const {
  noting = false;
  std::vector<std::int64_t> result;
  for (const auto& [hash, range] : places) {
    result.push_back(range.first);
    result.push_back(range.second);
  }
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

std::int64_t live_blocks() { return live; }

}  // namespace flipfree::test
