#include "flipfree/base/failure.h"

#include <charconv>
#include <regex>

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

namespace {

std::string other_id(const std::string& digits, const std::function<Index(Index)>& other) {
  Index id = kInvalid;
  const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), id);
  if (read.ec != std::errc()) return digits;
  const Index renamed = other(id);
  return renamed == kInvalid ? digits : std::to_string(renamed);
}

}  // namespace

std::string renumbered(const std::string& text, const Renumbering& numbers) {
  // Word, first id, and for pairs of vertices what joins the second one.
  static const std::regex named(
      R"(\b(?:(Vertex|vertex|Vertices|vertices|Edge|edge)|(Face|face)|(Corner|corner)) (\d+)(?:(-| and )(\d+))?)");
  std::string result;
  auto rest = text.cbegin();
  for (std::sregex_iterator it(text.begin(), text.end(), named), end; it != end; ++it) {
    const std::smatch& match = *it;
    const auto& other = match[1].matched   ? numbers.vertex
                        : match[2].matched ? numbers.face
                                           : numbers.corner;
    result.append(rest, match[4].first);
    result += other_id(match[4].str(), other);
    rest = match[4].second;
    // "face 3 and 4 more" is one id.
    if (match[1].matched && match[6].matched) {
      result += match[5].str() + other_id(match[6].str(), other);
      rest = match[6].second;
    }
  }
  result.append(rest, text.cend());
  return result;
}

}  // namespace flipfree
