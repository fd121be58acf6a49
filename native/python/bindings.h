// Solver calls as Python makes them: module.<name>(vertices, faces, {option: value}, threads)
// starts a job on a C++ thread, which touches no Python; Python polls, cancels and collects. And
// what goes between Python and the solver besides what pybind11 converts itself: matrices
// (eigen.h), containers and options that may be missing (stl.h). Shapes and types were checked in
// Python.
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <boost/preprocessor/seq/for_each.hpp>
#include <boost/preprocessor/stringize.hpp>
#include <boost/preprocessor/tuple/elem.hpp>
#include <boost/preprocessor/variadic/to_seq.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <new>
#include <string>
#include <system_error>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/stats.h"
#include "flipfree/certify/certify.h"
#include "flipfree/conformal/map.h"
#include "flipfree/field/compute.h"
#include "flipfree/intrinsic/loops.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/quads/quads.h"

namespace flipfree::python {

namespace py = pybind11;

// What flipfree/results.py makes its dataclasses of. Large arrays are taken out of the map: of a
// million faces a copy is felt by who works in a window meanwhile.
py::object to_python(const Error& error);
py::object to_python(const Stats& stats);
py::object to_python(const mesh::Mend& mend);
py::object to_python(const certify::Certificate& certificate);
py::object to_python(certify::Parametrization&& map);
py::object to_python(const conformal::ConformalMetric& metric);
py::object to_python(conformal::ConformalMapResult&& result);
py::object to_python(quads::QuadCertificate&& certificate);
py::object to_python(quads::QuadMesh&& mesh);

// Input faces that hold the points, and their weights there.
std::pair<std::vector<FaceId>, Points3> places_of(const std::vector<mesh::SurfacePoint>& points);

// For FLIPFREE_EACH: {name: value}, of values that are left behind.
struct DictWriter {
  py::dict found;

  template <typename Value>
  void operator()(const char* name, Value& value) {
    found[name] = py::cast(std::move(value));
  }
};

}  // namespace flipfree::python

namespace pybind11::detail {

// Numbers as arrays; what nobody else needs goes to Python with its memory.
template <typename T>
struct NumbersCaster {
  PYBIND11_TYPE_CASTER(std::vector<T>, const_name("numpy.ndarray"));

  bool load(handle source, bool) {
    const auto given = array_t<T, array::c_style | array::forcecast>::ensure(source);
    if (!given) return false;
    value.assign(given.data(), given.data() + given.size());
    return true;
  }
  template <typename Values>
  static handle cast(Values&& values, return_value_policy, handle) {
    auto owned = std::make_unique<std::vector<T>>(std::forward<Values>(values));
    const T* data = owned->data();
    const auto count = static_cast<ssize_t>(owned->size());
    const capsule owner(owned.release(),
                        [](void* kept) { delete static_cast<std::vector<T>*>(kept); });
    return array_t<T>(count, data, owner).release();
  }
};
template <>
struct type_caster<std::vector<flipfree::Index>> : NumbersCaster<flipfree::Index> {};
template <>
struct type_caster<std::vector<double>> : NumbersCaster<double> {};
template <>
struct type_caster<std::vector<std::int8_t>> : NumbersCaster<std::int8_t> {};

// From (corners 3 f + k, uv).
template <>
struct type_caster<std::vector<flipfree::certify::CornerPin>> {
  PYBIND11_TYPE_CASTER(std::vector<flipfree::certify::CornerPin>, const_name("tuple"));

  bool load(handle source, bool) {
    const auto [corners, uv] =
        source.cast<std::pair<std::vector<flipfree::Index>, flipfree::Points2>>();
    for (std::size_t i = 0; i < corners.size(); ++i)
      value.push_back({corners[i], uv.row(static_cast<Eigen::Index>(i)).transpose()});
    return true;
  }
};

// Tuples of members.
template <typename Struct, auto... kMembers>
struct TupleCaster {
  PYBIND11_TYPE_CASTER(Struct, const_name("tuple"));

  bool load(handle source, bool) {
    std::tie(value.*kMembers...) =
        source.cast<std::tuple<std::decay_t<decltype(std::declval<Struct>().*kMembers)>...>>();
    return true;
  }
  static handle cast(const Struct& whole, return_value_policy, handle) {
    return pybind11::make_tuple(whole.*kMembers...).release();
  }
};
template <>  // each of which may be empty
struct type_caster<flipfree::field::GivenField>
    : TupleCaster<flipfree::field::GivenField, &flipfree::field::GivenField::directions,
                  &flipfree::field::GivenField::rotation, &flipfree::field::GivenField::quarters> {
};
template <>
struct type_caster<flipfree::intrinsic::LoopTurn>
    : TupleCaster<flipfree::intrinsic::LoopTurn, &flipfree::intrinsic::LoopTurn::loop,
                  &flipfree::intrinsic::LoopTurn::quarter_turns> {};

// What only goes to Python.
struct ResultCaster {
  static constexpr auto name = const_name("object");
  template <typename Result>
  static handle cast(Result&& result, return_value_policy, handle) {
    return flipfree::python::to_python(std::forward<Result>(result)).release();
  }
};
template <>
struct type_caster<flipfree::Stats> : ResultCaster {};
template <typename Result>
requires requires(Result result) { flipfree::python::to_python(std::move(result)); }
struct type_caster<Result> : ResultCaster {};

}  // namespace pybind11::detail

namespace flipfree::python {

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

// Words of a choice: those of its enumerators in their order, "" of one that Python does not have.
template <typename Choice>
constexpr std::array<const char*, 0> kWords{};

// For FLIPFREE_EACH: takes members of options out of {name: value}. One that the dict does not have
// keeps the solver's default.
class OptionReader {
 public:
  explicit OptionReader(const py::dict& given) : given_(given) {}

  // Whether it is there. Throws InvalidInput for what is no word of a choice.
  template <typename Value>
  bool operator()(const char* name, Value& member) {
    if (!given_.contains(name)) return false;
    ++read_;
    if constexpr (std::is_enum_v<Value>) {
      py::list words;
      for (const char* word : kWords<Value>)
        if (*word != '\0') words.append(word);
      const py::object check = py::module_::import("flipfree.checks").attr("as_choice");
      const auto chosen = check(given_[name], name, words).template cast<std::string>();
      member = static_cast<Value>(std::ranges::find(kWords<Value>, chosen) - kWords<Value>.begin());
    } else {
      member = given_[name].cast<Value>();
    }
    return true;
  }
  template <typename Value>
  Value value(const char* name) {
    Value found{};
    (*this)(name, found);
    return found;
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

// FLIPFREE_EACH(visit, value, cuts, seams.find) is visit("cuts", value.cuts); visit("seams.find",
// value.seams.find);
#define FLIPFREE_EACH(visit, value, ...) \
  BOOST_PP_SEQ_FOR_EACH(FLIPFREE_MEMBER, (visit, value), BOOST_PP_VARIADIC_TO_SEQ(__VA_ARGS__))
#define FLIPFREE_MEMBER(_, of, member) \
  BOOST_PP_TUPLE_ELEM(0, of)(BOOST_PP_STRINGIZE(member), BOOST_PP_TUPLE_ELEM(1, of).member);

// What reads a solver's options of this type: these members, by their names.
#define FLIPFREE_READER(Options, ...)         \
  [](OptionReader& read) {                    \
    Options options;                          \
    FLIPFREE_EACH(read, options, __VA_ARGS__) \
    return options;                           \
  }

// `prepare(read)` reads the options, on the Python thread, and returns `solve(surface, context)`,
// whose result goes to Python as pybind11 or the casters above know how.
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

}  // namespace flipfree::python
