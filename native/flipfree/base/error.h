// Errors: one closed enum, one value type, and the exceptions thrown at the API's edge.
#pragma once

#include <concepts>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "flipfree/base/types.h"

namespace flipfree {

// A list of LINE(name, text) as an enum of the names, and as the cases of the text for each.
#define FLIPFREE_ENUMERATOR(name, text) name,
#define FLIPFREE_CASE_OF_TEXT(name, text) \
  case Enum::name:                        \
    return text;

// Every way in which a call can fail, and the short fixed text for it alone: describe().
#define FLIPFREE_ERROR_CODES(CODE)                                      \
  /* Input that no algorithm here accepts. */                           \
  CODE(kEmptyMesh, "empty mesh")                                        \
  CODE(kBadShape, "array of the wrong shape")                           \
  CODE(kIndexOutOfRange, "index out of range")                          \
  CODE(kNotFinite, "coordinate is not finite")                          \
  CODE(kRepeatedCorner, "face uses a vertex twice")                     \
  CODE(kDuplicateFace, "duplicate face")                                \
  CODE(kNonManifoldEdge, "non-manifold edge")                           \
  CODE(kInconsistentOrientation, "inconsistent orientation")            \
  CODE(kNonManifoldVertex, "non-manifold vertex")                       \
  CODE(kZeroAreaFace, "zero-area face")                                 \
  CODE(kZeroLengthEdge, "zero-length edge")                             \
  CODE(kIsolatedVertex, "isolated vertex")                              \
  CODE(kDisconnected, "mesh is not connected")                          \
  CODE(kNotADisk, "mesh is not a disk")                                 \
  CODE(kNotAnEdge, "not an edge of the mesh")                           \
  CODE(kBadOption, "bad option")                                        \
  CODE(kFlippedMap, "map has flips")                                    \
  CODE(kBadBoundary, "bad boundary")                                    \
  CODE(kNotConvex, "polygon is not convex")                             \
  CODE(kNoQuad, "no quad")                                              \
  CODE(kNoGrid, "no grid")                                              \
  CODE(kBadPins, "bad pins")                                            \
  CODE(kBadAngles, "bad angles")                                        \
  /* Targets that no map can meet. */                                   \
  CODE(kNoRoomInPolygon, "no room in the polygon")                      \
  CODE(kNotSelfOverlapping, "polygon is not weakly self-overlapping")   \
  CODE(kContradictoryPins, "contradictory pins")                        \
  CODE(kGaussBonnet, "angles violate Gauss-Bonnet")                     \
  /* The solver gave up, or its result did not pass the certificate. */ \
  CODE(kIterationLimit, "iteration limit reached")                      \
  CODE(kLineSearchStalled, "line search stalled")                       \
  CODE(kFactorizationFailed, "factorization failed")                    \
  CODE(kRoundingFlips, "rounding to 32 bits flips triangles")           \
  CODE(kCertificateFailed, "certificate failed")                        \
  CODE(kTimeLimit, "time limit reached")                                \
  /* The caller asked to stop. */                                       \
  CODE(kCancelled, "cancelled")                                         \
  /* A bug of ours, caught by an invariant. */                          \
  CODE(kInternal, "internal error")

enum class ErrorCode { FLIPFREE_ERROR_CODES(FLIPFREE_ENUMERATOR) };

enum class ElementKind { kNone, kVertex, kEdge, kFace, kCorner };

// The numbers that prove that no map can meet a target, for others to check by other means. The
// rules, and what their numbers mean, are listed in docs/errors.md. Empty: nothing is proved.
struct Witness {
  std::string rule;
  std::vector<std::pair<std::string, std::vector<double>>> numbers;
};

// What failed, where, and what to do about it.
struct Error {
  ErrorCode code = ErrorCode::kInternal;
  std::string message{};  // one sentence what and where, one sentence cure; ids are marked
  ElementKind kind = ElementKind::kNone;
  // Ids of the elements at fault (edges as vertex pairs), at most 1000.
  std::vector<Index> elements{};
  Witness witness{};  // of Infeasible only
};

// The id of an element in a message: its digits after a byte that tells its kind, so that whoever
// works on a part of a mesh can put the whole's ids in their place (renumbered(), failure.h) and
// nothing else of the sentence.
template <std::integral Id>
std::string marked_id(ElementKind kind, Id id) {
  return static_cast<char>(kind) + std::to_string(id);
}
template <std::integral Id>
std::string vertex_id(Id v) {
  return marked_id(ElementKind::kVertex, v);
}
template <std::integral Id>
std::string face_id(Id f) {
  return marked_id(ElementKind::kFace, f);
}
template <std::integral Id>
std::string corner_id(Id c) {
  return marked_id(ElementKind::kCorner, c);
}
// The kind of element whose id follows this byte of a message; kNone of others.
inline ElementKind kind_of_mark(char c) {
  return c > 0 && c <= static_cast<char>(ElementKind::kCorner) ? static_cast<ElementKind>(c)
                                                               : ElementKind::kNone;
}
// A message as people read it, without these marks: at the library's edge.
std::string rendered(std::string message);

// E.g. "non-manifold edge".
std::string_view describe(ErrorCode code);

// Base of everything that the library throws across its public functions.
class Exception : public std::runtime_error {
 public:
  explicit Exception(Error error)
      : std::runtime_error(rendered(error.message)), error_(std::move(error)) {}
  const Error& error() const { return error_; }

 private:
  Error error_;
};

class InvalidInput : public Exception {
  using Exception::Exception;
};
class Infeasible : public Exception {
  using Exception::Exception;
};
class NotConverged : public Exception {
  using Exception::Exception;
};
class Cancelled : public Exception {
 public:
  Cancelled() : Exception({ErrorCode::kCancelled, "Cancelled by the caller."}) {}
};
// Thrown by ExecutionContext::check() when a TimeLimit is over. Not a NotConverged: those who give
// a way up on that and take another must not go on. Whoever set the limit catches it, and returns
// what was found in time or throws NotConverged (kTimeLimit).
class TimeIsOver : public Exception {
 public:
  TimeIsOver() : Exception({ErrorCode::kTimeLimit, "Time is over."}) {}
};
class InternalError : public Exception {
 public:
  explicit InternalError(std::string message)
      : Exception({ErrorCode::kInternal, std::move(message)}) {}
};

// Throws InvalidInput with these parts.
[[noreturn]] void throw_invalid(ErrorCode code, std::string message,
                                ElementKind kind = ElementKind::kNone,
                                std::vector<Index> elements = {});
// Throws Infeasible with these parts: a proof, which the witness holds.
[[noreturn]] void throw_infeasible(ErrorCode code, std::string message, Witness witness,
                                   ElementKind kind = ElementKind::kNone,
                                   std::vector<Index> elements = {});
// Throws NotConverged with these parts.
[[noreturn]] void throw_not_converged(ErrorCode code, std::string message,
                                      ElementKind kind = ElementKind::kNone,
                                      std::vector<Index> elements = {});

// kTimeLimit: `what` did not happen in the time allowed, do `cure` or allow more. max_seconds: as
// the caller gave it, 0 if somebody else did.
Error out_of_time(const std::string& what, double max_seconds, const std::string& cure);
// Throws NotConverged with it.
[[noreturn]] void throw_out_of_time(const std::string& what, double max_seconds,
                                    const std::string& cure);

}  // namespace flipfree
