// Wavefront OBJ. Indices count from 1, or back from the last element so far where negative.
#include <algorithm>
#include <vector>

#include "flipfree/mesh/files/plain_form.h"
#include "flipfree/mesh/files/text.h"

namespace flipfree::mesh {
namespace {

struct Corner {
  long long vertex = 0, texture = 0;  // from 1; texture 0: none
};

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
    check(largest_vertex_, coordinates_.size() / 3, "vertex");
    check(largest_texture_, textures_, "texture coordinate");
    plain_.extension = ".obj";
    plain_.positions = to_points(coordinates_);
  }
  PlainForm take() { return std::move(plain_); }

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
    plain_.text += "v 0 0 0\n";
  }

  void texture_coordinate(std::string_view rest, const std::string& place) {
    const float u = to_float(next_word(rest), place, "a texture coordinate");
    const std::string_view second = next_word(rest);
    const float v = second.empty() ? 0.0F : to_float(second, place, "a texture coordinate");
    count_of(++textures_, place);
    plain_.text += "vt ";
    append_number(plain_.text, u);
    plain_.text += ' ';
    append_number(plain_.text, v);
    plain_.text += '\n';
  }

  // One of a corner's indices, from 1.
  static long long resolve(std::string_view word, std::size_t so_far, const std::string& place) {
    const long long index = to_integer(word, place, "an index of a face");
    const long long resolved = index < 0 ? static_cast<long long>(so_far) + 1 + index : index;
    if (resolved < 1)
      refuse(place, "a face has the index " + std::to_string(index) + ", which names nothing");
    return resolved;
  }

  Corner corner(std::string_view word, const std::string& place) const {
    const std::size_t slash = word.find('/');
    Corner result;
    result.vertex = resolve(word.substr(0, slash), coordinates_.size() / 3, place);
    if (slash == std::string_view::npos) return result;
    const std::string_view texture = word.substr(slash + 1, word.find('/', slash + 1) - slash - 1);
    if (!texture.empty()) result.texture = resolve(texture, textures_, place);
    return result;
  }

  void face(std::string_view rest, const Lines& lines) {
    const std::string place = lines.place();
    corners_.clear();
    for (auto word = next_word(rest); !word.empty() && word[0] != '#'; word = next_word(rest))
      corners_.push_back(corner(word, place));
    check_corners(place);
    plain_.text += 'f';
    for (const Corner& c : corners_) {
      plain_.text += ' ';
      append_number(plain_.text, c.vertex);
      largest_vertex_.see(c.vertex, lines);
      if (c.texture == 0) continue;
      plain_.text += '/';
      append_number(plain_.text, c.texture);
      largest_texture_.see(c.texture, lines);
    }
    plain_.text += '\n';
    plain_.corner_uv = plain_.corner_uv || corners_[0].texture != 0;
    plain_.polygons = count_of(static_cast<std::size_t>(plain_.polygons) + 1, place);
  }

  void check_corners(const std::string& place) {
    if (corners_.size() < 3) refuse(place, "a face has fewer than three corners");
    const bool textured = corners_[0].texture != 0;
    if (!std::all_of(corners_.begin(), corners_.end(),
                     [&](const Corner& c) { return (c.texture != 0) == textured; }))
      refuse(place, "some corners of a face have texture coordinates and some have not");
    used_.clear();
    for (const Corner& c : corners_) used_.push_back(c.vertex);
    std::sort(used_.begin(), used_.end());
    if (std::adjacent_find(used_.begin(), used_.end()) != used_.end())
      refuse(place, "a face uses one vertex twice",
             "Delete such faces (Merge by Distance), and write the file again");
  }

  static void check(const Largest& largest, std::size_t count, const char* what) {
    if (largest.index > static_cast<long long>(count))
      refuse(largest.place, std::string("a face uses ") + what + " " +
                                std::to_string(largest.index) + ", the file has " +
                                std::to_string(count));
  }

  PlainForm plain_;
  std::vector<double> coordinates_;
  std::size_t textures_ = 0;
  Largest largest_vertex_, largest_texture_;
  std::vector<Corner> corners_;
  std::vector<long long> used_;
  std::string joined_;
};

}  // namespace

PlainForm plain_obj(std::string_view bytes) {
  Obj obj;
  obj.read(bytes);
  return obj.take();
}

}  // namespace flipfree::mesh
