// Solver calls as Python makes them: module.<name>(vertices, faces, {option: value}, threads)
// starts a job on a C++ thread, which touches no Python; Python polls, cancels and collects.
#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <initializer_list>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "casters.h"
#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::python {

namespace py = pybind11;

class Job {
 public:
  // Called on the Python thread: converts what the solver returned.
  using Result = std::function<py::object()>;

  // Starts `work` at once on a new thread.
  Job(std::function<Result(ExecutionContext&)> work, int threads) {
    context_.threads = threads;
    try {
      // Moved: a copy would be one of the caller's arrays, too.
      result_ = std::async(std::launch::async, [this, work = std::move(work)] {
        context_.check();
        return work(context_);
      });
    } catch (const std::system_error&) {  // no memory for the thread's stack
      throw std::bad_alloc();
    }
  }
  // Cancels and waits.
  ~Job() {
    context_.cancel();
    const py::gil_scoped_release release;
    result_ = {};
  }
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;

  // Waits up to `seconds` without the GIL; true when the work has ended, well or badly.
  bool wait(double seconds) const {
    const py::gil_scoped_release release;
    return result_.wait_for(std::chrono::duration<double>(seconds)) == std::future_status::ready;
  }
  void cancel() { context_.cancel(); }
  // See ExecutionContext::accept().
  void accept() { context_.accept(); }
  std::pair<std::string, double> progress() const {
    return {context_.stage(), context_.fraction()};
  }
  // Waits for the end; the result, which is taken, or what the solver threw.
  py::object result() {
    while (!wait(kLongest)) {
    }
    return result_.get()();
  }

 private:
  static constexpr double kLongest = 1e6;

  ExecutionContext context_;
  std::shared_future<Result> result_;
};

// Reads {name: value} member by member. A member that the dict does not have keeps the solver's
// default.
class OptionReader {
 public:
  explicit OptionReader(const py::dict& given) : given_(given) {}

  // Whether it is there.
  template <typename Value>
  bool operator()(const char* name, Value& member) {
    if (!given_.contains(name)) return false;
    ++read_;
    member = given_[name].cast<Value>();
    return true;
  }
  template <typename Value>
  Value value(const char* name) {
    Value found{};
    (*this)(name, found);
    return found;
  }
  // One of `choices`, by its name. Throws InvalidInput if it is none.
  template <typename Value>
  void choice(const char* name, Value& member,
              std::initializer_list<std::pair<std::string_view, Value>> choices) {
    std::string given;
    if (!(*this)(name, given)) return;
    for (const auto& [word, value] : choices) {
      if (word == given) {
        member = value;
        return;
      }
    }
    throw_invalid(ErrorCode::kBadOption, std::string(name) + " cannot be \"" + given + "\".");
  }
  // Throws InvalidInput if an option was not read, which the call does not have.
  void end() const {
    if (read_ != given_.size())
      throw_invalid(ErrorCode::kBadOption,
                    "There is an option that this call does not have, among " +
                        py::str(py::list(given_)).cast<std::string>() + ".");
  }

 private:
  py::dict given_;
  std::size_t read_ = 0;
};

// `prepare(read)` reads the options, on the Python thread, and returns `solve(surface, context)`,
// whose result goes to Python as pybind11 or casters.h know how.
template <typename Prepare>
void def_job(py::module_& module, const char* name, Prepare prepare) {
  module.def(name,
             [prepare](Points3 vertices, Triangles faces, const py::dict& options, int threads) {
               OptionReader read(options);
               auto solve = prepare(read);
               read.end();
               return std::make_unique<Job>(
                   [surface = mesh::Surface{std::move(vertices), std::move(faces)},
                    solve = std::move(solve)](ExecutionContext& context) mutable -> Job::Result {
                     using Result = decltype(solve(surface, context));
                     auto result = std::make_shared<Result>(solve(surface, context));
                     return [result] { return py::object(py::cast(std::move(*result))); };
                   },
                   threads);
             });
}

// The same of `solve(surface, options, context)`, whose options `read_options` reads.
template <typename Options, typename Result>
void def_call(py::module_& module, const char* name, Options (*read_options)(OptionReader&),
              Result (*solve)(const mesh::Surface&, const Options&, ExecutionContext&)) {
  def_job(module, name, [read_options, solve](OptionReader& read) {
    return [options = read_options(read), solve](const mesh::Surface& surface,
                                                 ExecutionContext& context) {
      return solve(surface, options, context);
    };
  });
}

// The calls, each in a file of its own, called by module.cpp.
void bind_conformal(py::module_& module);
void bind_maps(py::module_& module);
void bind_meshes(py::module_& module);
void bind_quads(py::module_& module);
void bind_seamless(py::module_& module);

}  // namespace flipfree::python
