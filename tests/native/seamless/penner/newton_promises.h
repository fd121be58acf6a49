// What is promised of both solvers in Penner coordinates, tried of each by the tests of its own
// file.
#pragma once

#include <gtest/gtest.h>

#include "flipfree/seamless/penner/penner_newton.h"

namespace flipfree::seamless {

class NewtonInPennerCoordinates : public testing::TestWithParam<decltype(&run_penner)> {};

}  // namespace flipfree::seamless
