// Wavefront OBJ. Indices count from 1, or back from the last element so far where negative.
#include <algorithm>
#include <numeric>
#include <span>
#include <vector>

#include "flipfree/mesh/files/plain_form.h"
#include "flipfree/mesh/files/text.h"

namespace flipfree::mesh {
namespace {

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
    write_faces();
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

  // A new map may be made of a file whose old one is broken.
  void texture_coordinate(std::string_view rest, const std::string& place) {
    float u = 0.0F, v = 0.0F;
    bool known = true;
    try {
      u = to_float(next_word(rest), place, "a texture coordinate");
      const std::string_view second = next_word(rest);
      if (!second.empty()) v = to_float(second, place, "a texture coordinate");
    } catch (const InvalidInput&) {
      known = false;
    }
    textures_.push_back(known ? 1 : 0);
    count_of(textures_.size(), place);
    plain_.text += "vt ";
    append_number(plain_.text, known ? u : 0.0F);
    plain_.text += ' ';
    append_number(plain_.text, known ? v : 0.0F);
    plain_.text += '\n';
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
          resolved(to_integer(texture, place, "an index of a face"), textures_.size()), 0LL);
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
    plain_.numbers.push_back(static_cast<Index>(faces_ - 1));
    ends_.push_back(corners_.size());
  }

  void check_vertices() const {
    const auto count = static_cast<long long>(coordinates_.size() / 3);
    if (largest_vertex_.index > count)
      refuse(largest_vertex_.place, "a face uses vertex " + std::to_string(largest_vertex_.index) +
                                        ", the file has " + std::to_string(count));
  }

  bool has_texture(const Corner& c) const {
    return c.texture > 0 && c.texture <= static_cast<long long>(textures_.size()) &&
           textures_[static_cast<std::size_t>(c.texture - 1)] != 0;
  }

  // Faces behind all elements that they use.
  void write_faces() {
    std::string faces;
    std::size_t first = 0;
    for (const std::size_t end : ends_) {
      const std::span<Corner> own(corners_.data() + first, end - first);
      const bool textured =
          std::all_of(own.begin(), own.end(), [&](const Corner& c) { return has_texture(c); });
      tell_apart(own);
      faces += 'f';
      for (const Corner& c : own) {
        faces += ' ';
        append_number(faces, c.vertex);
        if (!textured) continue;
        faces += '/';
        append_number(faces, c.texture);
      }
      faces += '\n';
      plain_.corner_uv = plain_.corner_uv || textured;
      first = end;
    }
    plain_.polygons = static_cast<Index>(ends_.size());
    for (std::size_t v = 0; v < plain_.again.size(); ++v) plain_.text += "v 0 0 0\n";
    plain_.text += faces;
  }

  // Vertices that one face uses again become others.
  void tell_apart(std::span<Corner> own) {
    order_.resize(own.size());
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) {
      return own[a].vertex != own[b].vertex ? own[a].vertex < own[b].vertex : a < b;
    });
    long long last = 0;
    for (const std::size_t k : order_) {
      const long long vertex = own[k].vertex;
      if (vertex == last) {
        plain_.again.push_back(static_cast<Index>(vertex - 1));
        const std::size_t number = coordinates_.size() / 3 + plain_.again.size();
        own[k].vertex = count_of(number, "End of the file");
      }
      last = vertex;
    }
  }

  PlainForm plain_;
  std::vector<double> coordinates_;
  std::vector<char> textures_;  // whether it is one
  std::size_t faces_ = 0;
  Largest largest_vertex_;
  std::vector<Corner> corners_;     // of all faces
  std::vector<std::size_t> ends_;   // of each face's corners
  std::vector<std::size_t> order_;  // of one face's corners
  std::string joined_;
};

}  // namespace

PlainForm plain_obj(std::string_view bytes) {
  Obj obj;
  obj.read(bytes);
  return obj.take();
}

}  // namespace flipfree::mesh
