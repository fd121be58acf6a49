#include "job.h"

#include <chrono>
#include <new>
#include <system_error>
#include <utility>

#include "flipfree/base/error.h"

namespace flipfree::python {

Job::Job(std::function<ResultMaker(ExecutionContext&)> work, int threads, std::uint64_t seed) {
  context_.threads = threads;
  context_.seed = seed;
  auto run = [this, work = std::move(work)] {
    ResultMaker maker;
    std::exception_ptr failure;
    try {
      context_.check();
      maker = work(context_);
    } catch (...) {
      failure = std::current_exception();
    }
    const std::scoped_lock lock(mutex_);
    maker_ = std::move(maker);
    failure_ = failure;
    ended_ = true;
    ended_signal_.notify_all();
  };
  try {
    // Moved: a copy would be one of the caller's arrays, too.
    thread_ = std::thread(std::move(run));
  } catch (const std::system_error&) {  // no memory for its stack
    throw std::bad_alloc();
  }
}

Job::~Job() {
  context_.cancel();
  if (thread_.joinable()) {
    const pybind11::gil_scoped_release release;
    thread_.join();
  }
}

bool Job::wait(double seconds) {
  const pybind11::gil_scoped_release release;
  std::unique_lock lock(mutex_);
  return ended_signal_.wait_for(lock, std::chrono::duration<double>(seconds),
                                [this] { return ended_; });
}

pybind11::object Job::result() {
  {
    const pybind11::gil_scoped_release release;
    std::unique_lock lock(mutex_);
    ended_signal_.wait(lock, [this] { return ended_; });
  }
  if (failure_) std::rethrow_exception(failure_);
  if (!maker_) throw InternalError("the result of this job was already collected");
  const ResultMaker maker = std::exchange(maker_, nullptr);
  return maker();
}

}  // namespace flipfree::python
