// The ways and devices of this stage that can be switched off, one at a time,
// to see what each of them earns. Nobody else does: all of them are in use.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace flipfree::matchmaker {

enum class Device {
  kContinuation,    // a valid map without the pins, then the pins moved to their targets
  kHomotopy,        // through the frames of a homotopy
  kOutlineOverlay,  // from the first frame to the last in one step
  kMatchmaker,      // the guarantee
  kCoarse,          // coarse to fine on large surfaces
  kPlanned,         // many pins inside a convex boundary at one stroke
  kArms,            // an arm for every pin
  kPull,            // pins one by one by continuation
  kEqualArea,       // inside an outline, pins move in a metric with room
  kSimplifyPlane,   // the planned motion's overlay is simplified before the map follows it
  kUntangle,        // vertices untangled away when all else has stopped
  kUnfold,          // whole faces unfolded
  kEase,            // rounds of untangling after arms and plans
};

constexpr std::array<std::string_view, 13> kDeviceNames = {
    "continuation", "homotopy", "outline overlay",   "matchmaker",     "coarse",   "planned",
    "arms",         "pull",     "equal-area metric", "simplify plane", "untangle", "unfold",
    "ease"};

// A set of devices, one bit for each.
using Devices = std::uint32_t;
inline bool contains(Devices set, Device device) {
  return (set >> static_cast<unsigned>(device) & 1u) != 0;
}

}  // namespace flipfree::matchmaker
