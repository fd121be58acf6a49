#include "flipfree/unwrap/seams/slits/carried_cut.h"

#include <gtest/gtest.h>

#include "flipfree/mesh/topology.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::carried_cut_test {
namespace {

mesh::Components pieces_of(mesh::Adjacency adjacency, const mesh::EdgeFlags& cut) {
  for (std::size_t h = 0; h < cut.size(); ++h) {
    if (cut[h] != 0) adjacency.opposite[h] = kInvalid;
  }
  return mesh::face_components(adjacency);
}

class CarriedCut : public ::testing::Test {
 protected:
  CarriedCut() : whole_(test::bumpy_grid(60, 60, 0.05, 2)), adjacency_(test::adjacency_of(whole_)) {
    levels_.push_back(mesh::decimate(whole_, 1500, context_));
    levels_.push_back(mesh::decimate(levels_[0].surface, 300, context_));
    few_adjacency_ = test::adjacency_of(few());
  }

  const mesh::Surface& few() const { return levels_.back().surface; }

  double middle(const mesh::Surface& surface, FaceId f, Index axis) const {
    double sum = 0.0;
    for (Index k = 0; k < 3; ++k) sum += surface.vertices(surface.faces(f, k), axis) / 3.0;
    return sum;
  }

  // Between faces of few() of different parts.
  template <typename Part>
  mesh::EdgeFlags between(Part part) const {
    mesh::EdgeFlags cut(few_adjacency_.opposite.size(), 0);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut.size()); ++h) {
      const HalfedgeId o = few_adjacency_.opposite[static_cast<std::size_t>(h)];
      if (o != kInvalid && part(h / 3) != part(o / 3)) cut[static_cast<std::size_t>(h)] = 1;
    }
    return cut;
  }

  ExecutionContext context_;
  mesh::Surface whole_;
  mesh::Adjacency adjacency_;
  std::vector<mesh::Decimated> levels_;
  mesh::Adjacency few_adjacency_;
};

TEST_F(CarriedCut, three_pieces_that_meet_stay_three_of_about_the_same_faces) {
  const auto part = [&](const mesh::Surface& surface, FaceId f) {
    return middle(surface, f, 0) < 0.5 ? 0 : middle(surface, f, 1) < 0.5 ? 1 : 2;
  };
  const mesh::EdgeFlags cut = between([&](FaceId f) { return part(few(), f); });
  ASSERT_EQ(pieces_of(few_adjacency_, cut).count, 3);
  const mesh::EdgeFlags carried = carried_cut(whole_, adjacency_, levels_, cut, {}, context_);
  ASSERT_EQ(carried.size(), adjacency_.opposite.size());
  const mesh::Components pieces = pieces_of(adjacency_, carried);
  ASSERT_EQ(pieces.count, 3);
  Index elsewhere = 0;
  for (FaceId f = 0; f < whole_.faces.rows(); ++f) {
    const double x = std::abs(middle(whole_, f, 0) - 0.5);
    const double y = std::abs(middle(whole_, f, 1) - 0.5);
    if (x < 0.2 || y < 0.2) continue;
    FaceId same = 0;
    while (part(whole_, same) != part(whole_, f) || std::abs(middle(whole_, same, 0) - 0.5) < 0.2 ||
           std::abs(middle(whole_, same, 1) - 0.5) < 0.2)
      ++same;
    elsewhere += pieces.of_face[static_cast<std::size_t>(f)] !=
                         pieces.of_face[static_cast<std::size_t>(same)]
                     ? 1
                     : 0;
  }
  EXPECT_EQ(elsewhere, 0);
}

TEST_F(CarriedCut, what_has_no_ends_is_not_carried) {
  const auto inside = [&](FaceId f) {
    return std::abs(middle(few(), f, 0) - 0.5) < 0.25 && std::abs(middle(few(), f, 1) - 0.5) < 0.25;
  };
  const mesh::EdgeFlags cut = between(inside);
  ASSERT_EQ(pieces_of(few_adjacency_, cut).count, 2);
  EXPECT_TRUE(carried_cut(whole_, adjacency_, levels_, cut, {}, context_).empty());
}

}  // namespace
}  // namespace flipfree::unwrap::carried_cut_test
