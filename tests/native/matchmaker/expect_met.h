// What a result of match must show.
#pragma once

#include <gtest/gtest.h>

#include "flipfree/certify/parametrization.h"
#include "flipfree/matchmaker/match.h"

namespace flipfree::test {

// Certified, and every pinned vertex bit for bit where it shall be, in 64 and in 32 bits.
inline void expect_met(const certify::Parametrization& map,
                       const matchmaker::MatchRequest& request) {
  EXPECT_TRUE(map.certificate.ok);
  for (const matchmaker::PinnedVertex& p : request.points) {
    for (CornerId c = 0; c < map.surface.faces.size(); ++c) {
      if (map.surface.faces.data()[c] != p.vertex) continue;
      EXPECT_EQ(map.uv.row(c).transpose(), p.uv);
      EXPECT_EQ(map.uv32.row(c).transpose(), p.uv.cast<float>());
    }
  }
}

}  // namespace flipfree::test
