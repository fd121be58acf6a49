// How well a call would use more cores than there are: its work, what of it is serial, and the
// seconds that the loops' chunks allow on so many cores.
//
// A context with a meter runs every parallel loop on its caller's thread, one chunk after another,
// and takes the time of each. For p cores the chunks are dealt out as parallel_for does it, each to
// the first core that is free. A loop inside a loop of k chunks has p / k cores of them, rounded
// down to one that is counted here, at least one. On any number of cores a loop takes as long as
// its longest chunk. Not counted: waking threads, and memory that is not faster for many cores than
// for one.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

namespace flipfree {

// CPU seconds of the calling thread.
double thread_seconds();

class WorkMeter {
 public:
  // The last: any number.
  static constexpr std::array<std::size_t, 6> kCores{1, 2, 4, 8, 16, static_cast<std::size_t>(-1)};
  using Seconds = std::array<double, kCores.size()>;

  struct Stage {
    const char* name;
    Seconds seconds{};    // on so many cores; the first is the work, the last the span
    double serial = 0.0;  // of the work, outside of all parallel loops
    std::size_t loops = 0;
  };

  explicit WorkMeter(std::function<double()> clock = thread_seconds);

  // Everything from here on belongs to the stage of this name (a string literal).
  void enter(const char* stage);
  // In the order in which they were entered first; until now.
  const std::vector<Stage>& stages();

  // While it lives, the calling thread does the chunks of one loop, one after another.
  class Loop {
   public:
    Loop(WorkMeter& meter, std::size_t chunks);
    ~Loop();
    Loop(const Loop&) = delete;
    Loop& operator=(const Loop&) = delete;
    void end_chunk();

   private:
    static constexpr std::size_t kMost = 16;
    WorkMeter& meter_;
    Seconds outer_;
    std::size_t cores_each_[kCores.size()];          // index into kCores, for loops inside
    std::array<double, kMost> busy_[kCores.size()];  // until when, per core
    std::size_t dealt_[kCores.size()];               // cores that take part
    Seconds longest_{};
  };

 private:
  void tick();

  std::function<double()> clock_;
  std::vector<Stage> stages_;
  std::size_t stage_ = 0;
  std::size_t depth_ = 0;
  double last_ = 0.0;
  Seconds now_{};  // since the chunk, or outside of loops the meter, began
};

}  // namespace flipfree
