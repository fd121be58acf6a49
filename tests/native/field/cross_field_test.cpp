#include "flipfree/field/cross_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "support/shapes.h"

namespace flipfree::field::cross_field_test {
namespace {

constexpr double kTestQuarter = 0.5 * std::numbers::pi;

struct Place {
  explicit Place(mesh::Surface given)
      : surface(std::move(given)),
        adjacency(mesh::build_adjacency(surface)),
        frames(measure_frames(surface)) {}

  std::size_t faces() const { return static_cast<std::size_t>(surface.faces.rows()); }
  CrossField random_field(unsigned seed) const {
    std::mt19937 random(seed);
    std::vector<double> angle(faces());
    for (double& a : angle) a = std::uniform_real_distribution<double>(-3.0, 3.0)(random);
    return match_nearest(adjacency, frames, std::move(angle));
  }

  mesh::Surface surface;
  mesh::Adjacency adjacency;
  Frames frames;
};

// Closed surfaces of genus 0, 1, 2, and ones with one and two boundary loops.
std::vector<Place> places() {
  std::vector<Place> all;
  for (mesh::Surface& s : std::vector<mesh::Surface>{
           test::sphere(8, 6), test::torus(12, 8), test::perforated_plate(2, 1),
           test::bumpy_grid(5, 4, 0.3, 1.0), test::cylinder(9, 4)})
    all.emplace_back(std::move(s));
  return all;
}

double off_quarters(double a) { return std::abs(std::remainder(a, kTestQuarter)); }

TEST(CrossFieldTest, NearestMatchingTurnsByAnEighthAtMost) {
  for (const Place& p : places()) {
    const CrossField field = p.random_field(3);
    const std::vector<double> rotation = rotation_form(p.adjacency, p.frames, field);
    for (std::size_t h = 0; h < rotation.size(); ++h) {
      EXPECT_LE(std::abs(rotation[h]), 0.5 * kTestQuarter + 1e-12);
      const HalfedgeId o = p.adjacency.opposite[h];
      if (o == kInvalid) continue;
      EXPECT_EQ(rotation[h], -rotation[static_cast<std::size_t>(o)]);
      EXPECT_EQ(field.matching[h], -field.matching[static_cast<std::size_t>(o)]);
    }
  }
}

TEST(CrossFieldTest, ARotationFormIsAFieldUpToOneTurn) {
  for (const Place& p : places()) {
    const CrossField field = p.random_field(5);
    const std::vector<double> rotation = rotation_form(p.adjacency, p.frames, field);
    const CrossField again = field_of_rotation(p.adjacency, p.frames, rotation);
    const double turned = again.angle[0] - field.angle[0];
    for (std::size_t f = 0; f < p.faces(); ++f)
      EXPECT_LT(off_quarters(again.angle[f] - field.angle[f] - turned), 1e-9);
    const std::vector<double> same = rotation_form(p.adjacency, p.frames, again);
    for (std::size_t h = 0; h < rotation.size(); ++h) EXPECT_NEAR(same[h], rotation[h], 1e-9);
  }
}

TEST(CrossFieldTest, FormsThatAreNoFieldsAreRefusedByTheirEdge) {
  const Place p(test::torus(6, 5));
  const CrossField field = p.random_field(1);
  std::vector<double> rotation = rotation_form(p.adjacency, p.frames, field);
  rotation[7] += 0.01;
  EXPECT_THROW(field_of_rotation(p.adjacency, p.frames, rotation), InvalidInput);
  rotation[static_cast<std::size_t>(p.adjacency.opposite[7])] -= 0.01;
  try {
    match_by_rotation(p.adjacency, p.frames, field.angle, rotation);
    FAIL();
  } catch (const InvalidInput& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kBadAngles);
    EXPECT_EQ(e.error().elements.size(), 1U);
  }
}

TEST(CrossFieldTest, DirectionsAreUnitVectorsInTheFacesAndComeBack) {
  for (const Place& p : places()) {
    const CrossField field = p.random_field(2);
    const Points3 directions = directions_of(p.surface, field.angle);
    const std::vector<double> angle = angles_of(p.surface, 17.0 * directions);
    for (std::size_t f = 0; f < p.faces(); ++f) {
      EXPECT_NEAR(directions.row(static_cast<Eigen::Index>(f)).norm(), 1.0, 1e-12);
      EXPECT_NEAR(std::remainder(angle[f] - field.angle[f], 4.0 * kTestQuarter), 0.0, 1e-9);
    }
  }
}

TEST(CrossFieldTest, DirectionsAcrossTheFaceAreRefused) {
  const Place p(test::grid(2, 1));
  Points3 directions = Points3::Zero(4, 3);
  directions.col(0).setOnes();
  directions.row(2) << 0.0, 0.0, 1.0;
  directions(3, 1) = std::nan("");
  try {
    angles_of(p.surface, directions);
    FAIL();
  } catch (const InvalidInput& e) {
    EXPECT_EQ(e.error().elements, (std::vector<Index>{2, 3}));
  }
}

TEST(CrossFieldTest, QuartersTurnTheNeighboursDirectionIntoThisOne) {
  // On a plane: direction(f) is direction(g) turned by so many quarters and by the rotation.
  const Place p(test::grid(3, 3));
  const CrossField field = p.random_field(8);
  const Points3 d = directions_of(p.surface, field.angle);
  const std::vector<Index> quarters = quarters_across(p.adjacency, field);
  const std::vector<double> rotation = rotation_form(p.adjacency, p.frames, field);
  for (HalfedgeId h = 0; h < 27; ++h) {
    const HalfedgeId o = p.adjacency.opposite[static_cast<std::size_t>(h)];
    if (o == kInvalid) continue;
    const Vector3 a = d.row(h / 3), b = d.row(o / 3);
    const double from_b = std::atan2(b.x() * a.y() - b.y() * a.x(), a.dot(b));
    const double predicted = quarters[static_cast<std::size_t>(h)] * kTestQuarter +
                             rotation[static_cast<std::size_t>(h)];
    EXPECT_NEAR(std::remainder(from_b - predicted, 4.0 * kTestQuarter), 0.0, 1e-9);
  }
  EXPECT_EQ(match_by_quarters(p.adjacency, p.frames, field.angle, quarters).matching,
            field.matching);
}

}  // namespace
}  // namespace flipfree::field::cross_field_test
