#include "flipfree/base/error.h"

#include <sstream>

namespace flipfree {

std::string_view describe(ErrorCode code) {
  switch (code) {
    case ErrorCode::kEmptyMesh:
      return "empty mesh";
    case ErrorCode::kBadShape:
      return "array of the wrong shape";
    case ErrorCode::kIndexOutOfRange:
      return "index out of range";
    case ErrorCode::kNotFinite:
      return "coordinate is not finite";
    case ErrorCode::kRepeatedCorner:
      return "face uses a vertex twice";
    case ErrorCode::kDuplicateFace:
      return "duplicate face";
    case ErrorCode::kNonManifoldEdge:
      return "non-manifold edge";
    case ErrorCode::kInconsistentOrientation:
      return "inconsistent orientation";
    case ErrorCode::kNonManifoldVertex:
      return "non-manifold vertex";
    case ErrorCode::kZeroAreaFace:
      return "zero-area face";
    case ErrorCode::kZeroLengthEdge:
      return "zero-length edge";
    case ErrorCode::kIsolatedVertex:
      return "isolated vertex";
    case ErrorCode::kDisconnected:
      return "mesh is not connected";
    case ErrorCode::kNotADisk:
      return "mesh is not a disk";
    case ErrorCode::kNotAnEdge:
      return "not an edge of the mesh";
    case ErrorCode::kBadOption:
      return "bad option";
    case ErrorCode::kFlippedMap:
      return "map has flips";
    case ErrorCode::kBadBoundary:
      return "bad boundary";
    case ErrorCode::kNotConvex:
      return "polygon is not convex";
    case ErrorCode::kNoQuad:
      return "no quad";
    case ErrorCode::kNoGrid:
      return "no grid";
    case ErrorCode::kBadPins:
      return "bad pins";
    case ErrorCode::kBadAngles:
      return "bad angles";
    case ErrorCode::kNoRoomInPolygon:
      return "no room in the polygon";
    case ErrorCode::kNotSelfOverlapping:
      return "polygon is not weakly self-overlapping";
    case ErrorCode::kContradictoryPins:
      return "contradictory pins";
    case ErrorCode::kGaussBonnet:
      return "angles violate Gauss-Bonnet";
    case ErrorCode::kIterationLimit:
      return "iteration limit reached";
    case ErrorCode::kLineSearchStalled:
      return "line search stalled";
    case ErrorCode::kFactorizationFailed:
      return "factorization failed";
    case ErrorCode::kRoundingFlips:
      return "rounding to 32 bits flips triangles";
    case ErrorCode::kCertificateFailed:
      return "certificate failed";
    case ErrorCode::kTimeLimit:
      return "time limit reached";
    case ErrorCode::kCancelled:
      return "cancelled";
    case ErrorCode::kInternal:
      return "internal error";
  }
  return "unknown error";
}

std::string rendered(std::string message) {
  std::erase_if(message, [](char c) { return kind_of_mark(c) != ElementKind::kNone; });
  return message;
}

void throw_invalid(ErrorCode code, std::string message, ElementKind kind,
                   std::vector<Index> elements) {
  throw InvalidInput({code, std::move(message), kind, std::move(elements)});
}

void throw_infeasible(ErrorCode code, std::string message, Witness witness, ElementKind kind,
                      std::vector<Index> elements) {
  throw Infeasible({code, std::move(message), kind, std::move(elements), std::move(witness)});
}

void throw_not_converged(ErrorCode code, std::string message, ElementKind kind,
                         std::vector<Index> elements) {
  throw NotConverged({code, std::move(message), kind, std::move(elements)});
}

Error out_of_time(const std::string& what, double max_seconds, const std::string& cure) {
  std::ostringstream message;
  message << what << " in the time allowed";
  if (max_seconds > 0) message << " (max_seconds = " << max_seconds << ")";
  message << ". Allow more time, " << cure << ".";
  return {ErrorCode::kTimeLimit, message.str()};
}

void throw_out_of_time(const std::string& what, double max_seconds, const std::string& cure) {
  throw NotConverged(out_of_time(what, max_seconds, cure));
}

}  // namespace flipfree
