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
#include <system_error>
#include <tuple>
#include <utility>

#include "casters.h"
#include "flipfree/base/context.h"
#include "flipfree/base/failure.h"
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
  // Of work that has ended: the result, which is taken, or what the solver threw.
  py::object result() { return result_.get()(); }

 private:
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
              std::initializer_list<std::pair<const char*, Value>> choices) {
    py::object given;
    if (!(*this)(name, given)) return;
    std::string words;
    for (const auto& [word, value] : choices) {
      words += (words.empty() ? "" : ", ") + std::string(word);
      if (!py::isinstance<py::str>(given)) continue;
      if (PyUnicode_CompareWithASCIIString(given.ptr(), word) != 0) continue;
      member = value;
      return;
    }
    const auto shown = py::module_::import("flipfree.checks").attr("shown")(given);
    throw_invalid(ErrorCode::kBadOption, std::string(name) + " must be one of " + words + ", not " +
                                             shown.cast<std::string>() + ".");
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

// FLIPFREE_READ(read, options, cuts, pins) reads options.cuts and options.pins by these names.
#define FLIPFREE_READ(read, options, ...) \
  FLIPFREE_REPEATED(FLIPFREE_REPEATED(FLIPFREE_READ_FIRST(read, options, __VA_ARGS__)))
#define FLIPFREE_READ_FIRST(read, options, member, ...) \
  read(#member, options.member);                        \
  __VA_OPT__(FLIPFREE_READ_REST FLIPFREE_NONE(read, options, __VA_ARGS__))
#define FLIPFREE_READ_REST() FLIPFREE_READ_FIRST
#define FLIPFREE_NONE ()
#define FLIPFREE_REPEATED(...) FLIPFREE_AGAIN(FLIPFREE_AGAIN(FLIPFREE_AGAIN(__VA_ARGS__)))
#define FLIPFREE_AGAIN(...) FLIPFREE_ONCE(FLIPFREE_ONCE(FLIPFREE_ONCE(__VA_ARGS__)))
#define FLIPFREE_ONCE(...) __VA_ARGS__

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

// The same under the option "max_seconds", as in_time() has it.
template <typename Prepare>
void def_job(py::module_& module, const char* name, const char* what, const char* cure,
             Prepare prepare) {
  def_job(module, name, [what, cure, prepare](OptionReader& read) {
    const auto max_seconds = read.value<double>("max_seconds");
    return [=, solve = prepare(read)](const auto& surface, auto& context) mutable {
      return in_time(context, max_seconds, what, cure, [&] { return solve(surface, context); });
    };
  });
}

// What reads one option.
template <typename Value>
auto option(const char* name) {
  return [name](OptionReader& read) { return read.value<Value>(name); };
}

// For def_job: `solve(surface, values..., context)` of what the readers find.
template <typename Solve, typename... Readers>
auto prepared(Solve solve, Readers... readers) {
  return [=](OptionReader& read) {
    return [solve, values = std::tuple{readers(read)...}](const mesh::Surface& surface,
                                                          ExecutionContext& context) {
      return std::apply([&](const auto&... value) { return solve(surface, value..., context); },
                        values);
    };
  };
}

// The calls, each in a file of its own, called by module.cpp.
void bind_conformal(py::module_& module);
void bind_maps(py::module_& module);
void bind_meshes(py::module_& module);
void bind_quads(py::module_& module);
void bind_seamless(py::module_& module);

}  // namespace flipfree::python
