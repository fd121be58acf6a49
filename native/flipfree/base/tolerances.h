// Every tolerance of the project, with unit and derivation. Whether a map is valid is decided by
// exact predicates, never by one of these; they judge figures that are real numbers by nature.
#pragma once

namespace flipfree {

// Radians. A prescribed cone angle is a rounded multiple of pi, and the corner angles that are
// summed are rounded from 53-bit coordinates: certify() accepts this much in the sum (G5).
inline constexpr double kConeAngleTolerance = 1e-6;

// Barycentric units. Weights are rounded doubles, and refinement of refinement composes them a few
// times: certify() accepts areas and positions that differ by this much relative to the input
// triangle (G7).
inline constexpr double kProvenanceTolerance = 1e-9;

// Radians. A conformal map whose rounding to 32 bits had to be repaired on the float grid is
// accepted only if its stored cone angles differ by less: triangles of a few grid steps bend, and a
// quarter turn must remain recognisable.
inline constexpr double kStoredAngleTolerance = 0.3;

}  // namespace flipfree
