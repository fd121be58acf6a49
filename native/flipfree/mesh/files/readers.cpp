// The polygons of OBJ, OFF, PLY and STL files.

#include <OpenMesh/Core/IO/importer/ImporterT.hh>
#include <OpenMesh/Core/IO/reader/STLReader.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <mutex>
#include <optional>
#include <sstream>
#include <type_traits>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/mesh/files/mesh_file.h"
#include "flipfree/mesh/files/text.h"

namespace flipfree::mesh {

namespace {

// Wavefront OBJ. Indices count from 1, or back from the last element so far where negative.

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

// Takes three coordinates off the words of a line.
void append_position(std::string_view words, const std::string& place, FilePolygons& polygons) {
  for (int i = 0; i < 3; ++i)
    polygons.coordinates.push_back(to_number(next_word(words), place, "a coordinate"));
  count_of(polygons.coordinates.size() / 3, place);
}

struct Corner {
  long long vertex = 0, texture = 0;  // from 1; texture 0: none
};

// Index from 1 of one that may count back from the last element so far, where negative.
long long resolved(long long index, std::size_t so_far) {
  return index < 0 ? static_cast<long long>(so_far) + 1 + index : index;
}

class Obj {
 public:
  FilePolygons read(std::string_view bytes) {
    Lines lines(bytes);
    while (lines.next()) {
      std::string_view rest = logical_line(lines);
      const std::string_view keyword = next_word(rest);
      if (keyword == "v") {
        append_position(rest, lines.place(), polygons_);
      } else if (keyword == "vt") {
        texture_coordinate(rest, lines.place());
      } else if (keyword == "f") {
        face(rest, lines.place());
      }
    }
    check_vertices();
    for (const Corner& c : corners_) {
      polygons_.corners.push_back(static_cast<Index>(c.vertex - 1));
      const bool textured = c.texture > 0 && 2 * at(c.texture) <= textures_.size();
      for (std::size_t i = 0; i < 2; ++i)
        polygons_.uv.push_back(textured ? textures_[2 * at(c.texture - 1) + i] : kNone);
    }
    return std::move(polygons_);
  }

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
    result.vertex = resolved(index, polygons_.coordinates.size() / 3);
    if (result.vertex < 1)
      refuse(place, "a face has the index " + std::to_string(index) + ", which names nothing");
    if (slash == std::string_view::npos) return result;
    const std::string_view texture = word.substr(slash + 1, word.find('/', slash + 1) - slash - 1);
    if (!texture.empty())
      result.texture = std::max(
          resolved(to_integer(texture, place, "an index of a face"), textures_.size() / 2), 0LL);
    return result;
  }

  void face(std::string_view rest, const std::string& place) {
    const std::size_t first = corners_.size();
    for (auto word = next_word(rest); !word.empty() && word[0] != '#'; word = next_word(rest))
      corners_.push_back(corner(word, place));
    count_of(++faces_, place);
    if (corners_.size() < first + 3) {
      corners_.resize(first);
      return;
    }
    for (std::size_t c = first; c < corners_.size(); ++c) {
      if (corners_[c].vertex <= largest_) continue;
      largest_ = corners_[c].vertex;
      largest_at_ = place;
    }
    polygons_.numbers.push_back(static_cast<Index>(faces_ - 1));
    polygons_.begin.push_back(count_of(corners_.size(), place));
  }

  void check_vertices() const {
    const auto count = static_cast<long long>(polygons_.coordinates.size() / 3);
    if (largest_ > count)
      refuse(largest_at_, "a face uses vertex " + std::to_string(largest_) + ", the file has " +
                              std::to_string(count));
  }

  FilePolygons polygons_;
  std::vector<float> textures_;  // 2 each, the first NaN where it is none
  std::size_t faces_ = 0;
  long long largest_ = 0;  // index that was used: elements may follow the faces that use them
  std::string largest_at_;
  std::vector<Corner> corners_;  // of all faces
  std::string joined_;
};

// OFF, one vertex or face a line; `#` begins a comment. What the prefixes ST, C and N announce
// (texture coordinates, colours, normals) stands behind the positions and is passed over.

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
    for (long long v = 0; v < vertices; ++v) {
      const std::string_view words = needed("vertex", v, vertices);  // lines_.place() is its line
      append_position(words, lines_.place(), polygons_);
    }
    for (long long f = 0; f < faces; ++f) face(needed("face", f, faces), f, vertices);
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

// PLY, text or binary of either byte order: element "vertex" with x, y, z and perhaps texture
// coordinates, element "face" with the list vertex_indices and perhaps the list texcoord, which has
// two numbers for every corner. Whatever else a file holds is stepped over.

struct Type {
  std::size_t size = 0;
  double (*decode)(const char* bytes) = nullptr;
  bool whole = false;
};
struct Property {
  std::string name;
  Type type;
  std::optional<Type> count;  // of lists
};
struct Element {
  std::string name;
  long long count = 0;
  std::vector<Property> properties;
};
enum class Encoding { kText, kLittleEndian, kBigEndian };

template <typename T>
constexpr Type kType{sizeof(T),
                     [](const char* bytes) {
                       T value;
                       std::memcpy(&value, bytes, sizeof value);
                       return static_cast<double>(value);
                     },
                     std::is_integral_v<T>};

Type type_of(std::string_view name, const std::string& place) {
  struct Named {
    std::string_view one, other;
    Type type;
  };
  static constexpr std::array<Named, 8> kTypes{{{"char", "int8", kType<std::int8_t>},
                                                {"uchar", "uint8", kType<std::uint8_t>},
                                                {"short", "int16", kType<std::int16_t>},
                                                {"ushort", "uint16", kType<std::uint16_t>},
                                                {"int", "int32", kType<std::int32_t>},
                                                {"uint", "uint32", kType<std::uint32_t>},
                                                {"float", "float32", kType<float>},
                                                {"double", "float64", kType<double>}}};
  for (const Named& named : kTypes)
    if (name == named.one || name == named.other) return named.type;
  refuse(place, "a property has an unknown type");
}

// The values behind the header, one after the other.
class Body {
 public:
  Body(std::string_view bytes, Encoding encoding) : rest_(bytes), encoding_(encoding) {}

  void skip(Type type, const std::string& place) { (void)raw(type, place); }

  double real(Type type, const std::string& place, const char* what) {
    const std::string_view bytes = raw(type, place);
    if (encoding_ == Encoding::kText) return to_number(bytes, place, what);
    const double value = decode(bytes, type);
    if (!std::isfinite(value)) refuse(place, std::string(what) + " is NaN or infinite");
    return value;
  }
  // NaN where there is no number that 32 bits hold: a new map may be made of such a file.
  float texture(Type type, const std::string& place) {
    const std::string_view bytes = raw(type, place);
    try {
      const double value = encoding_ == Encoding::kText
                               ? to_number(bytes, place, "a texture coordinate")
                               : decode(bytes, type);
      if (std::isfinite(value)) return narrowed(value, place, "a texture coordinate");
    } catch (const InvalidInput&) {
    }
    return kNone;
  }
  long long integer(Type type, const std::string& place, const char* what) {
    const std::string_view bytes = raw(type, place);
    if (encoding_ == Encoding::kText) return to_integer(bytes, place, what);
    if (!type.whole) refuse(place, std::string(what) + " is not a whole number");
    return static_cast<long long>(decode(bytes, type));
  }

 private:
  // The bytes of the next value, as they stand.
  std::string_view raw(Type type, const std::string& place) {
    std::size_t size = type.size;
    if (encoding_ == Encoding::kText) {
      constexpr std::string_view kBlank = " \t\r\n\v\f";
      rest_.remove_prefix(std::min(rest_.find_first_not_of(kBlank), rest_.size()));
      size = std::min(rest_.find_first_of(kBlank), rest_.size());
    }
    if (rest_.empty() || size > rest_.size()) refuse(place, "the file ends here");
    const std::string_view bytes = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return bytes;
  }

  double decode(std::string_view raw_bytes, Type type) const {
    std::array<char, 8> bytes{};
    std::copy(raw_bytes.begin(), raw_bytes.end(), bytes.begin());
    if (encoding_ == Encoding::kBigEndian)
      std::reverse(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(type.size));
    return type.decode(bytes.data());
  }

  std::string_view rest_;
  Encoding encoding_;
};

struct Header {
  Encoding encoding = Encoding::kText;
  std::vector<Element> elements;
  std::string_view body;
};

Encoding encoding_of(std::string_view word, const std::string& place) {
  if (word == "ascii") return Encoding::kText;
  if (word == "binary_little_endian") return Encoding::kLittleEndian;
  if (word == "binary_big_endian") return Encoding::kBigEndian;
  refuse(place, "the format is none of ascii, binary_little_endian, binary_big_endian");
}

Property property_of(std::string_view rest, const std::string& place) {
  Property property;
  std::string_view word = next_word(rest);
  if (word == "list") {
    property.count = type_of(next_word(rest), place);
    word = next_word(rest);
  }
  property.type = type_of(word, place);
  property.name = next_word(rest);
  return property;
}

Header header_of(std::string_view bytes) {
  Header header;
  Lines lines(bytes);
  if (!lines.next() || (lines.line() != "ply" && lines.line() != "PLY"))
    refuse("Line 1", "the file does not begin with 'ply'");
  bool has_format = false;
  while (lines.next()) {
    std::string_view rest = lines.line();
    const std::string_view keyword = next_word(rest);
    if (keyword == "end_header") {
      if (!has_format) refuse(lines.place(), "the header names no format");
      header.body = lines.rest();
      return header;
    }
    if (keyword == "format") {
      header.encoding = encoding_of(next_word(rest), lines.place());
      has_format = true;
    } else if (keyword == "element") {
      Element element;
      element.name = next_word(rest);
      element.count = to_integer(next_word(rest), lines.place(), "a count");
      if (element.count < 0) refuse(lines.place(), "a count is negative");
      header.elements.push_back(std::move(element));
    } else if (keyword == "property") {
      if (header.elements.empty()) refuse(lines.place(), "a property of no element");
      header.elements.back().properties.push_back(property_of(rest, lines.place()));
    } else if (keyword != "comment" && keyword != "obj_info" && !keyword.empty()) {
      refuse(lines.place(), "the header has a line that is unknown");
    }
  }
  refuse("End of the file", "the header has no end");
}

class Ply {
 public:
  explicit Ply(std::string_view bytes)
      : header_(header_of(bytes)), body_(header_.body, header_.encoding) {}

  FilePolygons read() {
    const Element* vertices = nullptr;
    const Element* faces = nullptr;
    for (const Element& element : header_.elements) {
      if (element.name == "vertex" && vertices == nullptr) {
        read_vertices(*(vertices = &element));
      } else if (element.name == "face" && faces == nullptr) {
        if (vertices == nullptr) refuse("Header", "the faces stand before the vertices");
        read_faces(*(faces = &element), vertices->count);
      } else {
        skip(element);
      }
    }
    if (vertices == nullptr || faces == nullptr)
      refuse("Header", "the file has no " + std::string(vertices == nullptr ? "vertices" : "faces"),
             "Export faces, not strips or points only");
    return std::move(polygons_);
  }

 private:
  void skip_property(const Property& property, const std::string& place) {
    const long long n =
        property.count ? body_.integer(*property.count, place, "the length of a list") : 1;
    for (long long i = 0; i < n; ++i) body_.skip(property.type, place);
  }
  void skip(const Element& element) {
    if (element.properties.empty()) return;
    for (long long i = 0; i < element.count; ++i)
      for (const Property& p : element.properties) skip_property(p, element.name);
  }

  // The property of that name, a list or none; null if there is none.
  static const Property* find(const Element& element, std::string_view name, bool list) {
    const auto& all = element.properties;
    const auto at = std::find_if(all.begin(), all.end(), [&](const Property& p) {
      return p.name == name && p.count.has_value() == list;
    });
    return at == all.end() ? nullptr : &*at;
  }
  // The two with the texture coordinates of vertices, null where there are none.
  static std::array<const Property*, 2> texture_of(const Element& element) {
    static constexpr std::array<std::array<std::string_view, 2>, 3> kNames{
        {{"s", "t"}, {"u", "v"}, {"texture_u", "texture_v"}}};
    for (const auto& [u, v] : kNames) {
      const auto *first = find(element, u, false), *second = find(element, v, false);
      if (first != nullptr && second != nullptr) return {first, second};
    }
    return {};
  }

  void read_vertices(const Element& element) {
    const std::array<const Property*, 3> axes{find(element, "x", false), find(element, "y", false),
                                              find(element, "z", false)};
    if (std::count(axes.begin(), axes.end(), nullptr) > 0)
      refuse("Header", "the vertices have no x, y and z");
    const std::array<const Property*, 2> texture = texture_of(element);
    for (long long v = 0; v < element.count; ++v) {
      const std::string place = "Vertex " + std::to_string(v);
      std::array<double, 3> position{};
      std::array<float, 2> uv{};
      for (const Property& property : element.properties) {
        const auto axis = std::find(axes.begin(), axes.end(), &property);
        const auto side = std::find(texture.begin(), texture.end(), &property);
        if (axis != axes.end()) {
          position[at(axis - axes.begin())] = body_.real(property.type, place, "a coordinate");
        } else if (side != texture.end()) {
          uv[at(side - texture.begin())] = body_.texture(property.type, place);
        } else {
          skip_property(property, place);
        }
      }
      count_of(polygons_.coordinates.size() / 3 + 1, place);
      polygons_.coordinates.insert(polygons_.coordinates.end(), position.begin(), position.end());
      if (texture[0] != nullptr) vertex_uv_.insert(vertex_uv_.end(), uv.begin(), uv.end());
    }
  }

  void read_faces(const Element& element, long long vertices) {
    const Property* corners = find(element, "vertex_indices", true);
    if (corners == nullptr) corners = find(element, "vertex_index", true);
    const Property* texture = find(element, "texcoord", true);
    if (corners == nullptr) refuse("Header", "the faces have no list vertex_indices");
    for (long long f = 0; f < element.count; ++f) {
      const std::string place = "Face " + std::to_string(f);
      polygon_.clear();
      uv_.clear();
      for (const Property& property : element.properties) {
        if (&property == corners) {
          read_polygon(property, place, vertices);
        } else if (&property == texture) {
          const long long n = body_.integer(*property.count, place, "the length of a list");
          for (long long i = 0; i < n; ++i) uv_.push_back(body_.texture(property.type, place));
        } else {
          skip_property(property, place);
        }
      }
      const Index number = count_of(static_cast<std::size_t>(f) + 1, place) - 1;
      if (polygon_.size() < 3) continue;
      polygons_.numbers.push_back(number);
      append_face(texture != nullptr);
    }
  }

  void read_polygon(const Property& property, const std::string& place, long long vertices) {
    const long long n = body_.integer(*property.count, place, "the number of corners");
    if (n < 0) refuse(place, "its number of corners is negative");
    for (long long k = 0; k < n; ++k) {
      const long long index = body_.integer(property.type, place, "an index");
      if (index < 0 || index >= vertices)
        refuse(place, "it uses vertex " + std::to_string(index) + ", the last is " +
                          std::to_string(vertices - 1));
      polygon_.push_back(static_cast<Index>(index));
    }
  }

  void append_face(bool corner_uv) {
    polygons_.corners.insert(polygons_.corners.end(), polygon_.begin(), polygon_.end());
    polygons_.begin.push_back(count_of(polygons_.corners.size(), "End of the file"));
    if (corner_uv) {
      uv_.resize(uv_.size() == 2 * polygon_.size() ? uv_.size() : 0);
      uv_.resize(2 * polygon_.size(), kNone);
      polygons_.uv.insert(polygons_.uv.end(), uv_.begin(), uv_.end());
    } else if (!vertex_uv_.empty()) {
      for (const Index v : polygon_)
        polygons_.uv.insert(polygons_.uv.end(), {vertex_uv_[2 * at(v)], vertex_uv_[2 * at(v) + 1]});
    }
  }

  Header header_;
  Body body_;
  FilePolygons polygons_;
  std::vector<float> vertex_uv_;
  std::vector<Index> polygon_;
  std::vector<float> uv_;
};

// STL, binary or text. Told apart by size: a binary file has 84 bytes and 50 for each triangle.

using namespace OpenMesh;  // the importer's interface names it in every line

static_assert(std::endian::native == std::endian::little);

constexpr std::size_t kHeader = 80, kStart = 84, kTriangle = 50;

std::uint32_t promised(std::string_view bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + kHeader, sizeof count);
  return count;
}

std::string to_binary(const std::vector<float>& corners) {
  const auto count = static_cast<std::uint32_t>(corners.size() / 9);
  std::string text(kStart + kTriangle * count, '\0');
  std::memcpy(text.data() + kHeader, &count, sizeof count);
  for (std::size_t t = 0; t < count; ++t)
    std::memcpy(text.data() + kStart + kTriangle * t + 12, corners.data() + 9 * t, 36);
  return text;
}

std::vector<float> from_binary(std::string_view bytes) {
  const std::size_t count = promised(bytes);
  std::vector<float> corners(9 * count);
  for (std::size_t t = 0; t < count; ++t) {
    std::memcpy(corners.data() + 9 * t, bytes.data() + kStart + kTriangle * t + 12, 36);
    for (std::size_t i = 9 * t; i < 9 * t + 9; ++i)
      if (!std::isfinite(corners[i]))
        refuse("Triangle " + std::to_string(t), "a coordinate is NaN or infinite",
               "Delete or move that vertex, and write the file again");
  }
  return corners;
}

std::vector<float> from_text(std::string_view bytes) {
  std::vector<float> corners;
  std::size_t loop = 0;
  bool ended = false;
  Lines lines(bytes);
  while (lines.next()) {
    std::string_view rest = lines.line();
    const std::string_view keyword = next_word(rest);
    if (keyword == "outer") loop = corners.size();
    ended = keyword == "endsolid" || (ended && keyword.empty());
    if (keyword == "vertex") {
      for (int i = 0; i < 3; ++i)
        corners.push_back(to_float(next_word(rest), lines.place(), "a coordinate"));
    } else if (keyword == "endloop" && corners.size() != loop + 9) {
      refuse(lines.place(), "a facet does not have three corners");
    }
  }
  if (!ended) refuse("End of the file", "the file ends before 'endsolid'");
  if (corners.size() % 9 != 0) refuse("End of the file", "corners outside of facets");
  return corners;
}

// Takes triangles as they come: OpenMesh's own importer drops those that its half-edges cannot hold
// (edges with three faces, orientations against each other).
class Collector final : public IO::ImporterT<TriMesh_ArrayKernelT<>> {
 public:
  Collector(TriMesh_ArrayKernelT<>& unused, FilePolygons& polygons)
      : ImporterT(unused), polygons_(polygons) {}

  VertexHandle add_vertex(const Vec3f& point) override {
    polygons_.coordinates.insert(polygons_.coordinates.end(), {point[0], point[1], point[2]});
    return VertexHandle(static_cast<int>(n_vertices()) - 1);
  }
  FaceHandle add_face(const VHandles& corners) override {
    for (const VertexHandle v : corners) polygons_.corners.push_back(v.idx());
    polygons_.begin.push_back(static_cast<Index>(polygons_.corners.size()));
    return FaceHandle(static_cast<int>(n_faces()) - 1);
  }
  std::size_t n_vertices() const override { return polygons_.coordinates.size() / 3; }
  std::size_t n_faces() const override { return polygons_.begin.size() - 1; }
  std::size_t n_edges() const override { return 0; }

 private:
  FilePolygons& polygons_;
};

// `text`: a binary file. Equal corners become one vertex.
FilePolygons read_binary(const std::string& text) {
  // The readers are single objects with state, and so are the streams that they complain to.
  static std::mutex one_at_a_time;
  const std::scoped_lock lock(one_at_a_time);
  omlog().disable();
  omout().disable();
  omerr().disable();
  FilePolygons polygons;
  TriMesh_ArrayKernelT<> unused;
  Collector collector(unused, polygons);
  IO::Options options = IO::Options::Binary;
  std::istringstream stream(text, std::ios::in | std::ios::binary);
  // Not through the manager of all readers, which knows of none where OpenMesh is linked
  // statically.
  if (!IO::STLReader().read(stream, collector, options) ||
      polygons.corners.size() != 3 * collector.n_faces())
    throw InternalError("OpenMesh did not read an STL file that holds together.");
  return polygons;
}

}  // namespace

FilePolygons read_obj(std::string_view bytes) { return Obj().read(bytes); }

FilePolygons read_off(std::string_view bytes) { return Off(bytes).read(); }

FilePolygons read_ply(std::string_view bytes) { return Ply(bytes).read(); }

FilePolygons read_stl(std::string_view bytes) {
  const bool binary =
      bytes.size() >= kStart && kStart + kTriangle * std::size_t{promised(bytes)} == bytes.size();
  std::string_view rest = bytes.substr(0, kHeader);
  rest.remove_prefix(std::min(rest.find_first_not_of(" \t\r\n"), rest.size()));
  if (!binary && !rest.starts_with("solid"))
    refuse("Start of the file",
           "neither text, which begins with 'solid', nor as many bytes as a "
           "binary file with that number of triangles has");
  const std::vector<float> corners = binary ? from_binary(bytes) : from_text(bytes);
  count_of(corners.size() / 9, "End of the file");
  return read_binary(to_binary(corners));
}

}  // namespace flipfree::mesh
