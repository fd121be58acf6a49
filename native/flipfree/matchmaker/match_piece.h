// Hard constraints on pieces with holes: a monkey's face has eyes, a T-shirt has sleeves.
//
//   fill every hole with a fan -> match (knows disks) -> take the fans away -> lower the distortion
//
// A flip-free map of the filled disk is one of the piece; the fans' own shape is of no interest and
// may be refined at no cost. What they did to the distortion is undone by improve(), which lets
// holes deform as they like.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/matchmaker/match.h"

namespace flipfree::matchmaker {

// As match(), also for connected pieces of genus 0 with more than one boundary loop. A prescribed
// boundary is that of the loop which request.boundary_loop names (it must, as there are several);
// with a free boundary the longest loop counts as the outer one. The other loops are holes: free,
// but for the pins and lines on them. Everything else, disks included, goes to match(). Guarantee,
// errors and stats as there, and "holes".
certify::Parametrization match_piece(const mesh::Surface& surface, const MatchRequest& request,
                                     const MatchOptions& options, ExecutionContext& context);

}  // namespace flipfree::matchmaker
