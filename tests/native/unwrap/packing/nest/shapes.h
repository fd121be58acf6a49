// Shapes to pack, for the tests of packing/nest.
#pragma once

#include "flipfree/unwrap/packing/nest/inflate.h"

namespace flipfree::test {

using unwrap::Contact;
using unwrap::Contacts;
using unwrap::Loop;
using unwrap::Pose;
using unwrap::Shape;

inline Loop box(double width, double height) {
  return {{0.0, 0.0}, {width, 0.0}, {width, height}, {0.0, height}};
}

inline Shape box_shape(double width, double height) {
  Vector2 middle;
  return unwrap::make_shape({box(width, height)}, 0.0, middle);
}

// A square frame of this side with a hole, walls a tenth thick.
inline Shape frame(double side) {
  Loop hole = box(0.8 * side, 0.8 * side);
  for (Vector2& p : hole) p += Vector2(0.1 * side, 0.1 * side);
  Vector2 middle;
  return unwrap::make_shape({box(side, side), {hole.rbegin(), hole.rend()}}, 0.0, middle);
}

inline std::vector<Contact> contacts(const std::vector<Shape>& shapes,
                                     const std::vector<Pose>& poses, double scale,
                                     const std::vector<Loop>& fixed, double reach) {
  return Contacts(shapes, fixed).find(poses, scale, reach, ExecutionContext());
}

}  // namespace flipfree::test
