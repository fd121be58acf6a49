#include "flipfree/base/failure.h"

#include <algorithm>
#include <charconv>

#include "flipfree/base/error.h"

namespace flipfree {

std::vector<FaceId> faces_at(const Error& error, const Triangles& faces) {
  if (error.kind == ElementKind::kFace) return error.elements;
  std::vector<FaceId> found;
  if (error.kind != ElementKind::kVertex) return found;
  for (FaceId f = 0; f < faces.rows(); ++f) {
    const auto corners = faces.row(f);
    if (std::find_first_of(corners.begin(), corners.end(), error.elements.begin(),
                           error.elements.end()) != corners.end()) {
      found.push_back(f);
    }
  }
  return found;
}

Index Renumbering::operator()(ElementKind kind, Index id) const {
  switch (kind) {
    case ElementKind::kVertex:
    case ElementKind::kEdge:
      return vertex(id);
    case ElementKind::kFace:
      return face(id);
    case ElementKind::kCorner:
      return corner(id);
    case ElementKind::kNone:
      break;
  }
  return id;
}

std::string renumbered(const std::string& text, const Renumbering& numbers) {
  std::string result;
  for (auto at = text.begin(); at != text.end();) {
    const ElementKind kind = kind_of_mark(*at);
    result += *at++;
    if (kind == ElementKind::kNone) continue;
    const auto end = std::find_if(at, text.end(), [](char c) { return c < '0' || c > '9'; });
    const std::string digits(at, end);
    Index id = kInvalid;
    std::from_chars(digits.data(), digits.data() + digits.size(), id);
    const Index other = id == kInvalid ? kInvalid : numbers(kind, id);
    result += other == kInvalid ? digits : std::to_string(other);
    at = end;
  }
  return result;
}

Error renumbered(Error error, const Renumbering& numbers) {
  error.message = renumbered(error.message, numbers);
  for (Index& id : error.elements) id = numbers(error.kind, id);
  if (std::find(error.elements.begin(), error.elements.end(), kInvalid) != error.elements.end()) {
    error.kind = ElementKind::kNone;
    error.elements.clear();
  }
  return error;
}

Renumbering known_in(Index vertices, Index faces) {
  const auto below = [](Index limit) {
    return [limit](Index id) { return id < limit ? id : kInvalid; };
  };
  return {below(vertices), below(faces), below(3 * faces)};
}

void require_invariant(const char* place, const std::string& broken) {
  if (!broken.empty()) throw InternalError(std::string(place) + ": " + broken);
}

}  // namespace flipfree
