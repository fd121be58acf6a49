// PLY, text or binary of either byte order: element "vertex" with x, y, z and perhaps texture
// coordinates, element "face" with the list vertex_indices and perhaps the list texcoord, which has
// two numbers for every corner. Whatever else a file holds is stepped over.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <vector>

#include "flipfree/mesh/files/mesh_file.h"
#include "flipfree/mesh/files/text.h"

namespace flipfree::mesh {
namespace {

enum class Kind { kSigned, kUnsigned, kReal };
struct Type {
  Kind kind = Kind::kReal;
  std::size_t size = 0;
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

Type type_of(std::string_view name, const std::string& place) {
  struct Named {
    std::string_view one, other;
    Type type;
  };
  static constexpr std::array<Named, 8> kTypes{{{"char", "int8", {Kind::kSigned, 1}},
                                                {"uchar", "uint8", {Kind::kUnsigned, 1}},
                                                {"short", "int16", {Kind::kSigned, 2}},
                                                {"ushort", "uint16", {Kind::kUnsigned, 2}},
                                                {"int", "int32", {Kind::kSigned, 4}},
                                                {"uint", "uint32", {Kind::kUnsigned, 4}},
                                                {"float", "float32", {Kind::kReal, 4}},
                                                {"double", "float64", {Kind::kReal, 8}}}};
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
    return std::numeric_limits<float>::quiet_NaN();
  }
  long long integer(Type type, const std::string& place, const char* what) {
    const std::string_view bytes = raw(type, place);
    if (encoding_ == Encoding::kText) return to_integer(bytes, place, what);
    if (type.kind == Kind::kReal) refuse(place, std::string(what) + " is not a whole number");
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

  template <typename T>
  static double as(const std::array<char, 8>& bytes) {
    T value;
    std::memcpy(&value, bytes.data(), sizeof value);
    return static_cast<double>(value);
  }
  double decode(std::string_view raw_bytes, Type type) const {
    std::array<char, 8> bytes{};
    for (std::size_t i = 0; i < bytes.size() && i < raw_bytes.size(); ++i)
      bytes[i] = raw_bytes[encoding_ == Encoding::kBigEndian ? raw_bytes.size() - 1 - i : i];
    if (type.kind == Kind::kReal) return type.size == 4 ? as<float>(bytes) : as<double>(bytes);
    const bool is_signed = type.kind == Kind::kSigned;
    switch (type.size) {
      case 1:
        return is_signed ? as<std::int8_t>(bytes) : as<std::uint8_t>(bytes);
      case 2:
        return is_signed ? as<std::int16_t>(bytes) : as<std::uint16_t>(bytes);
      default:
        return is_signed ? as<std::int32_t>(bytes) : as<std::uint32_t>(bytes);
    }
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
    polygons_.positions = to_points(coordinates_);
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

  // The two properties with the texture coordinates of vertices, -1 where there are none.
  static std::array<int, 2> texture_of(const Element& element) {
    static constexpr std::array<std::array<std::string_view, 2>, 3> kNames{
        {{"s", "t"}, {"u", "v"}, {"texture_u", "texture_v"}}};
    for (const auto& names : kNames) {
      const std::array<int, 2> found{scalar(element, names[0]), scalar(element, names[1])};
      if (found[0] >= 0 && found[1] >= 0) return found;
    }
    return {-1, -1};
  }
  static int scalar(const Element& element, std::string_view name) {
    const auto& list = element.properties;
    const auto at = std::find_if(list.begin(), list.end(),
                                 [&](const Property& p) { return p.name == name && !p.count; });
    return at == list.end() ? -1 : static_cast<int>(at - list.begin());
  }

  void read_vertices(const Element& element) {
    const std::array<int, 3> axes{scalar(element, "x"), scalar(element, "y"), scalar(element, "z")};
    if (*std::min_element(axes.begin(), axes.end()) < 0)
      refuse("Header", "the vertices have no x, y and z");
    const std::array<int, 2> texture = texture_of(element);
    for (long long v = 0; v < element.count; ++v) {
      const std::string place = "Vertex " + std::to_string(v);
      std::array<double, 3> position{};
      std::array<float, 2> uv{};
      for (int i = 0; i < static_cast<int>(element.properties.size()); ++i) {
        const Property& property = element.properties[static_cast<std::size_t>(i)];
        const auto axis = std::find(axes.begin(), axes.end(), i);
        const auto side = std::find(texture.begin(), texture.end(), i);
        if (axis != axes.end()) {
          position[static_cast<std::size_t>(axis - axes.begin())] =
              body_.real(property.type, place, "a coordinate");
        } else if (side != texture.end()) {
          uv[static_cast<std::size_t>(side - texture.begin())] =
              body_.texture(property.type, place);
        } else {
          skip_property(property, place);
        }
      }
      count_of(coordinates_.size() / 3 + 1, place);
      coordinates_.insert(coordinates_.end(), position.begin(), position.end());
      if (texture[0] >= 0) vertex_uv_.insert(vertex_uv_.end(), uv.begin(), uv.end());
    }
  }

  void read_faces(const Element& element, long long vertices) {
    const auto list = [&](std::string_view name) {
      const auto& all = element.properties;
      const auto at = std::find_if(all.begin(), all.end(),
                                   [&](const Property& p) { return p.name == name && p.count; });
      return at == all.end() ? nullptr : &*at;
    };
    const Property* corners = list("vertex_indices");
    if (corners == nullptr) corners = list("vertex_index");
    const Property* texture = list("texcoord");
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
      uv_.resize(2 * polygon_.size(), std::numeric_limits<float>::quiet_NaN());
      polygons_.uv.insert(polygons_.uv.end(), uv_.begin(), uv_.end());
    } else if (!vertex_uv_.empty()) {
      for (const Index v : polygon_)
        polygons_.uv.insert(polygons_.uv.end(), {vertex_uv_[2 * at(v)], vertex_uv_[2 * at(v) + 1]});
    }
  }

  Header header_;
  Body body_;
  FilePolygons polygons_;
  std::vector<double> coordinates_;
  std::vector<float> vertex_uv_;
  std::vector<Index> polygon_;
  std::vector<float> uv_;
};

}  // namespace

FilePolygons read_ply(std::string_view bytes) { return Ply(bytes).read(); }

}  // namespace flipfree::mesh
