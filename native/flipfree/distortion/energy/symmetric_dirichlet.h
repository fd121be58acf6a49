// Symmetric Dirichlet energy of one triangle: value, gradient, and Hessian made positive
// semi-definite.
//
//   J    2 x 2 Jacobian of the map from the triangle's rest shape to the plane, det J > 0
//   s1 >= s2 > 0  its singular values,  f(J) = (|J|^2 + |J^-1|^2) / 4 = psi(s1) + psi(s2),
//   psi(s) = (s^2 + s^-2) / 4;  f = 1 for isometries.
//
// The Hessian's eigen-matrices in 2D (Smith, de Goes, Kim 2019, "Analytic Eigensystems for
// Isotropic Distortion Energies") need no singular vectors. With J = [a b; c d] split into its
// similarity part (E, H) = ((a + d)/2, (c - b)/2) and its anti-similarity part (F, G) = ((a - d)/2,
// (c + b)/2), Q = |(E, H)|, R = |(F, G)|:
//
//   P = [E -H; H  E] / (Q sqrt 2)   scale together      s1 = Q + R,  s2 = Q - R = det J / s1
//   N = [F  G; G -F] / (R sqrt 2)   scale against       (s1 P + N directions: U e1 e1' V' = (P +
//   N)/sqrt 2) T = [-H -E; E -H] / (Q sqrt 2)  twist, the only one whose eigenvalue can be negative
//   L = [-G  F; F  G] / (R sqrt 2)  flip
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "flipfree/base/types.h"

namespace flipfree::distortion {

// Rest shape of one triangle: rows of `gradient` are the gradients of the barycentric coordinates
// of corners 1 and 2 (inverse of the 2 x 2 matrix of rest edges), `determinant` its determinant (1
// / twice the rest area); `weight` is the triangle's share of the energy.
struct RestTriangle {
  double gradient[2][2] = {{0, 0}, {0, 0}};
  double determinant = 0;
  double weight = 0;
};

// Determinant of [a b; c d] given that its true sign is known to be positive: accurate to rounding
// of the entries even for slivers, and never below what rounding of the entries alone could hide.
double positive_determinant(double a, double b, double c, double d);

// Jacobian and its determinant. Precondition: the UV triangle is positively oriented (by exact
// test).
struct Jacobian {
  double a, b, c, d, determinant;
};
Jacobian jacobian(const RestTriangle& rest, const double* p0, const double* p1, const double* p2);
// Of face f of a map, #V x 2.
inline Jacobian jacobian(const RestTriangle& rest, const Triangles& faces, std::size_t f,
                         const Points2& uv) {
  const Index* v = faces.data() + 3 * f;
  const auto point = [&](int k) { return uv.data() + 2 * static_cast<std::ptrdiff_t>(v[k]); };
  return jacobian(rest, point(0), point(1), point(2));
}

// f(J), not weighted.
double symmetric_dirichlet(const Jacobian& j);

// Singular values (s1 >= s2).
std::array<double, 2> singular_values(const Jacobian& j);

// Of a function of J = (a, b, c, d) with this slope and curvature, weighted: the gradient with
// respect to the three corners' UV, (u0, v0, u1, v1, u2, v2), and unless `hessian` is null the
// Hessian: blocks (0,0) (1,1) (2,2) as (uu, uv, vv) and then blocks (0,1) (1,2) (2,0) as (uu, uv,
// vu, vv), first letter for the first corner.
inline constexpr int kHessianEntries = 21;
void corner_derivatives(const RestTriangle& rest, const Eigen::Vector4d& slope,
                        const Eigen::Matrix4d& curvature, double gradient[6], double* hessian);

// The same of f, with the Hessian made positive semi-definite. Returns f(J). With `soft`, the
// curvature of the scale modes is that of the parabola that has its minimum at an isometry and the
// right slope (Rabinovich, Poranne, Panozzo, Sorkine-Hornung 2017, "Scalable Locally Injective
// Mappings"), and the flip mode's is not larger: for small singular values the true curvature,
// s^-4, allows only steps of s / 3.
double symmetric_dirichlet_derivatives(const RestTriangle& rest, const Jacobian& j,
                                       double gradient[6], double* hessian, bool soft = false);

}  // namespace flipfree::distortion
