#include "flipfree/seamless/penner/shortest_newton.h"

#include "seamless/penner/newton_promises.h"

namespace flipfree::seamless::shortest_newton_test {

INSTANTIATE_TEST_SUITE_P(Shortest, NewtonInPennerCoordinates, testing::Values(&run_shortest));

}  // namespace flipfree::seamless::shortest_newton_test
