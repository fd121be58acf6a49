// Milnor's Lobachevsky function, the negative integral of log |2 sin t| from 0 to x (half of the
// Clausen function of 2 x): what the convex energy of discrete conformal maps is made of
// (Springborn, Schroeder, Pinkall 2008, equation 8).
#pragma once

namespace flipfree::numeric {

// For x in [0, pi]. Absolute error below 1e-15.
double lobachevsky(double x);

}  // namespace flipfree::numeric
