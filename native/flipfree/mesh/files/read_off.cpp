// OFF, one vertex or face a line; `#` begins a comment. What the prefixes ST, C and N announce
// (texture coordinates, colours, normals) stands behind the positions and is passed over.
#include <algorithm>
#include <vector>

#include "flipfree/mesh/files/mesh_file.h"
#include "flipfree/mesh/files/text.h"

namespace flipfree::mesh {
namespace {

class Off {
 public:
  explicit Off(std::string_view bytes) : lines_(bytes) {}

  FilePolygons read() {
    std::string_view counts = header();
    const long long vertices = to_integer(next_word(counts), lines_.place(), "a count");
    const long long faces = to_integer(next_word(counts), lines_.place(), "a count");
    if (vertices < 0 || faces < 0) refuse(lines_.place(), "a count is negative");
    count_of(static_cast<std::size_t>(vertices), lines_.place());
    count_of(static_cast<std::size_t>(faces), lines_.place());
    std::vector<double> coordinates;
    for (long long v = 0; v < vertices; ++v) vertex(needed("vertex", v, vertices), coordinates);
    for (long long f = 0; f < faces; ++f) face(needed("face", f, faces), f, vertices);
    polygons_.positions = to_points(coordinates);
    return std::move(polygons_);
  }

 private:
  // The next line that says something, without its comment; false if there is none.
  bool next(std::string_view& content) {
    while (lines_.next()) {
      content = lines_.line().substr(0, lines_.line().find('#'));
      std::string_view rest = content;
      if (!next_word(rest).empty()) return true;
    }
    return false;
  }
  std::string_view needed(const char* what, long long at, long long of) {
    std::string_view content;
    if (!next(content))
      refuse("End of the file", std::string(what) + " " + std::to_string(at) + " of " +
                                    std::to_string(of) + " is missing");
    return content;
  }

  // The line with the counts; the keyword may stand before them, or be left out.
  std::string_view header() {
    std::string_view line = needed("line", 0, 2);
    std::string_view rest = line;
    std::string_view keyword = next_word(rest);
    if (!keyword.ends_with("OFF")) {
      if (keyword.find_first_not_of("+0123456789") == std::string_view::npos) return line;
      refuse(lines_.place(), "the file does not begin with OFF");
    }
    keyword.remove_suffix(3);
    if (keyword.starts_with("ST")) keyword.remove_prefix(2);
    if (keyword.find_first_not_of("CN") != std::string_view::npos)
      refuse(lines_.place(), "this kind of OFF file has no three coordinates a vertex",
             "Write it as plain OFF");
    std::string_view after = rest;
    if (next_word(after) == "BINARY")
      refuse(lines_.place(), "binary OFF files are not read", "Write it as text, or as .ply");
    after = rest;
    return next_word(after).empty() ? needed("line", 1, 2) : rest;
  }

  void vertex(std::string_view rest, std::vector<double>& coordinates) {
    const std::string place = lines_.place();
    for (int i = 0; i < 3; ++i)
      coordinates.push_back(to_number(next_word(rest), place, "a coordinate"));
  }

  void face(std::string_view rest, long long number, long long vertices) {
    const std::string place = lines_.place();
    const long long corners = to_integer(next_word(rest), place, "a number of corners");
    if (corners < 0) refuse(place, "a number of corners is negative");
    if (corners < 3) return;
    polygons_.numbers.push_back(static_cast<Index>(number));
    for (long long k = 0; k < corners; ++k) {
      const long long index = to_integer(next_word(rest), place, "an index of a face");
      if (index < 0 || index >= vertices)
        refuse(place, "a face uses vertex " + std::to_string(index) + ", the last is " +
                          std::to_string(vertices - 1));
      polygons_.corners.push_back(static_cast<Index>(index));
    }
    polygons_.begin.push_back(count_of(polygons_.corners.size(), place));
  }

  Lines lines_;
  FilePolygons polygons_;
};

}  // namespace

FilePolygons read_off(std::string_view bytes) { return Off(bytes).read(); }

}  // namespace flipfree::mesh
