// A solver call running on its own C++ thread. The thread touches no Python; Python polls, cancels
// and collects.
#pragma once

#include <pybind11/pybind11.h>

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "flipfree/base/context.h"

namespace flipfree::python {

// Made on the worker thread, called on the Python thread: converts what the solver returned.
using ResultMaker = std::function<pybind11::object()>;

class Job {
 public:
  // Starts `work` at once on a new thread.
  Job(std::function<ResultMaker(ExecutionContext&)> work, int threads, std::uint64_t seed);
  // Cancels and waits; releases the GIL meanwhile.
  ~Job();
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;

  // Waits up to `seconds` without the GIL; true when the work has ended, well or badly.
  bool wait(double seconds);
  void cancel() { context_.cancel(); }
  // See ExecutionContext::accept().
  void accept() { context_.accept(); }
  std::pair<std::string, double> progress() const {
    return {context_.stage(), context_.fraction()};
  }
  // Waits for the end; returns the result or rethrows what the solver threw. May be called once.
  pybind11::object result();

 private:
  ExecutionContext context_;
  std::mutex mutex_;
  std::condition_variable ended_signal_;
  bool ended_ = false;
  ResultMaker maker_;
  std::exception_ptr failure_;
  std::thread thread_;
};

// Runs `solve(context) -> R` as a job whose result is `convert(R&) -> py::object`, which may take
// what it needs out of it.
template <typename Solve, typename Convert>
std::unique_ptr<Job> start_job(Solve solve, Convert convert, int threads, std::uint64_t seed = 0) {
  return std::make_unique<Job>(
      [solve = std::move(solve),
       convert = std::move(convert)](ExecutionContext& context) mutable -> ResultMaker {
        auto result = std::make_shared<decltype(solve(context))>(solve(context));
        return [result, convert]() -> pybind11::object { return convert(*result); };
      },
      threads, seed);
}

}  // namespace flipfree::python
