// Wavefront OBJ. Indices count from 1, or back from the last element so far where negative.
#include <algorithm>
#include <limits>
#include <vector>

#include "flipfree/mesh/files/mesh_file.h"
#include "flipfree/mesh/files/text.h"

namespace flipfree::mesh {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

struct Corner {
  long long vertex = 0, texture = 0;  // from 1; texture 0: none
};

// Index from 1 of one that may count back from the last element so far, where negative.
long long resolved(long long index, std::size_t so_far) {
  return index < 0 ? static_cast<long long>(so_far) + 1 + index : index;
}

// The largest index that was used, and where: elements may follow the faces that use them.
struct Largest {
  long long index = 0;
  std::string place;
  void see(long long used, const Lines& lines) {
    if (used <= index) return;
    index = used;
    place = lines.place();
  }
};

class Obj {
 public:
  void read(std::string_view bytes) {
    Lines lines(bytes);
    while (lines.next()) {
      std::string_view rest = logical_line(lines);
      const std::string_view keyword = next_word(rest);
      if (keyword == "v") {
        position(rest, lines.place());
      } else if (keyword == "vt") {
        texture_coordinate(rest, lines.place());
      } else if (keyword == "f") {
        face(rest, lines);
      }
    }
    check_vertices();
    polygons_.positions = to_points(coordinates_);
    for (const Corner& c : corners_) {
      polygons_.corners.push_back(static_cast<Index>(c.vertex - 1));
      for (std::size_t i = 0; i < 2; ++i)
        polygons_.uv.push_back(has_texture(c) ? textures_[2 * texture_of(c) + i] : kNone);
    }
  }
  FilePolygons take() { return std::move(polygons_); }

 private:
  // A backslash at its end joins a line to the next.
  std::string_view logical_line(Lines& lines) {
    if (!lines.line().ends_with('\\')) return lines.line();
    joined_.clear();
    for (;;) {
      const std::string_view line = lines.line();
      const bool goes_on = line.ends_with('\\');
      joined_.append(line.substr(0, line.size() - (goes_on ? 1 : 0))).push_back(' ');
      if (!goes_on || !lines.next()) return joined_;
    }
  }

  void position(std::string_view rest, const std::string& place) {
    for (int i = 0; i < 3; ++i)
      coordinates_.push_back(to_number(next_word(rest), place, "a coordinate"));
    count_of(coordinates_.size() / 3, place);
  }

  // A new map may be made of a file whose old one is broken.
  void texture_coordinate(std::string_view rest, const std::string& place) {
    float u = kNone, v = 0.0F;
    try {
      const float first = to_float(next_word(rest), place, "a texture coordinate");
      const std::string_view second = next_word(rest);
      if (!second.empty()) v = to_float(second, place, "a texture coordinate");
      u = first;
    } catch (const InvalidInput&) {
    }
    textures_.insert(textures_.end(), {u, v});
    count_of(textures_.size() / 2, place);
  }

  Corner corner(std::string_view word, const std::string& place) const {
    const std::size_t slash = word.find('/');
    const long long index = to_integer(word.substr(0, slash), place, "an index of a face");
    Corner result;
    result.vertex = resolved(index, coordinates_.size() / 3);
    if (result.vertex < 1)
      refuse(place, "a face has the index " + std::to_string(index) + ", which names nothing");
    if (slash == std::string_view::npos) return result;
    const std::string_view texture = word.substr(slash + 1, word.find('/', slash + 1) - slash - 1);
    if (!texture.empty())
      result.texture = std::max(
          resolved(to_integer(texture, place, "an index of a face"), textures_.size() / 2), 0LL);
    return result;
  }

  void face(std::string_view rest, const Lines& lines) {
    const std::string place = lines.place();
    const std::size_t first = corners_.size();
    for (auto word = next_word(rest); !word.empty() && word[0] != '#'; word = next_word(rest))
      corners_.push_back(corner(word, place));
    count_of(++faces_, place);
    if (corners_.size() < first + 3) {
      corners_.resize(first);
      return;
    }
    for (std::size_t c = first; c < corners_.size(); ++c)
      largest_vertex_.see(corners_[c].vertex, lines);
    polygons_.numbers.push_back(static_cast<Index>(faces_ - 1));
    polygons_.begin.push_back(count_of(corners_.size(), place));
  }

  void check_vertices() const {
    const auto count = static_cast<long long>(coordinates_.size() / 3);
    if (largest_vertex_.index > count)
      refuse(largest_vertex_.place, "a face uses vertex " + std::to_string(largest_vertex_.index) +
                                        ", the file has " + std::to_string(count));
  }

  bool has_texture(const Corner& c) const {
    return c.texture > 0 && c.texture <= static_cast<long long>(textures_.size() / 2);
  }
  static std::size_t texture_of(const Corner& c) { return static_cast<std::size_t>(c.texture - 1); }

  FilePolygons polygons_;
  std::vector<double> coordinates_;
  std::vector<float> textures_;  // 2 each, the first NaN where it is none
  std::size_t faces_ = 0;
  Largest largest_vertex_;
  std::vector<Corner> corners_;  // of all faces
  std::string joined_;
};

}  // namespace

FilePolygons read_obj(std::string_view bytes) {
  Obj obj;
  obj.read(bytes);
  return obj.take();
}

}  // namespace flipfree::mesh
