// Which cones and loop angles a seamless map can have (thesis 5.1, 6.2; issue of strata without
// surfaces).
//
// A flat metric with cone angles k pi / 2 and holonomies in quarter turns is a quartic differential
// with zeros of order k - 4. Where there is a metric at all is known (Bainbridge, Chen, Gendron,
// Grushevsky, Moeller 2019, "Strata of k-differentials"; Chen, Gendron 2022, "Towards a
// classification of connected components of strata of k-differentials"; Boissy 2015):
//
//   genus 0: always. genus >= 3: always.
//   genus 1: no cones: only if no loop turns at all. Two cones 4 + m and 4 - m: not if m divides
//            the turns of all loops; so never for m = 1, the cones (3, 5).
//   genus 2: one cone of 12, or two of 6 and 10 quarter turns: not if all loops turn by half turns,
//            unless (12 only) all turn by whole ones.
#pragma once

#include <string>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/types.h"

namespace flipfree::seamless {

// Quarter turns around a vertex where the surface is flat.
inline constexpr Index kFlat = 4;

// Quarter turns of the vertices that are not flat, sorted.
std::vector<Index> cone_list(const std::vector<Index>& cones);

// Genus of a closed connected surface whose cone quarter turns fit, by Gauss-Bonnet.
// `cones`: quarter turns k of every vertex, 4 where the surface is flat. Throws InvalidInput
// (kBadAngles) for k < 1, Infeasible (kGaussBonnet) with what is missing if the sum of 4 - k is not
// 8 - 8 genus.
void check_cones(const std::vector<Index>& cones, Index genus);

// Why there is no metric with these cones and loop turns (quarter turns of a homology basis); empty
// if there is one. Precondition: check_cones() passed.
std::string why_impossible(const std::vector<Index>& cones, Index genus,
                           const std::vector<Index>& loop_turns);

}  // namespace flipfree::seamless
