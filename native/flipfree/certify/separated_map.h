// Maps of meshes that are no clean surface: judged on what separate() makes of them, and said in
// terms of the mesh that the caller has.
#pragma once

#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/certify.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/mesh/separated/separated.h"

namespace flipfree::certify {

// Whether a mesh can be worked on as it is: a valid surface whose every face has a shape. Cost:
// O(#F).
bool is_clean(const mesh::Surface& surface, const ExecutionContext& context);

// certify() for any mesh but one without meaning (InvalidInput, see separate()). A clean surface is
// judged as it is. Any other is separated first, along the map, and what it took stands in
// Certificate::mends; faces that use a vertex twice have no triangle and are judged by their pins
// only, faces without area have no share in the distortion. Precondition: the map is on the mesh's
// own triangles (no parent). Cost: that of validating and separating beside certify()'s.
Certificate certify_any(const CertifyRequest& request, const ExecutionContext& context);

// What a solver is given and gives back in place of a mesh that is not clean.
class SeparatedMap {
 public:
  // As separate() does. Throws InvalidInput also where no face has three different vertices. The
  // input must outlive this.
  SeparatedMap(const mesh::Surface& input, const mesh::SeparateOptions& options,
               const ExecutionContext& context);

  const mesh::SeparatedSurface& separated() const { return separated_; }
  // The surface, at positions where every face has an area (mesh/separated/separated.h).
  const mesh::Surface& surface() const { return rest_; }
  IndexPairs edges(const IndexPairs& of_input) const;
  // Edges of surface() as those of the input that they come from, each once, ascending.
  IndexPairs edges_of_input(const IndexPairs& of_surface) const;
  // Pins at corners of faces without a triangle are left out: on_input() sees to them. Throws
  // InvalidInput (kBadPins) for pins that no corner can have.
  std::vector<CornerPin> pins(const std::vector<CornerPin>& of_input) const;
  Points2 corners(const Points2& of_input) const;
  // Those of faces without a triangle are left out. Precondition: they exist.
  std::vector<CornerId> corners(const std::vector<CornerId>& of_input) const;
  // work(), a solver on surface(), with errors and certificates in terms of the input.
  template <typename Work>
  auto solve(Work&& work) const -> decltype(std::forward<Work>(work)()) {
    try {
      return with_errors([this](const Error& error) { return in_terms_of_input(error); },
                         std::forward<Work>(work));
    } catch (const CertificateFailed& e) {
      throw CertificateFailed(in_terms_of_input(e.error()), in_terms_of_input(e.certificate()));
    }
  }
  // Elements, and the ids in the texts.
  Error in_terms_of_input(Error error) const;
  Certificate in_terms_of_input(Certificate certificate) const;

  // A solution on surface(), with its own triangulation, as a map of the input; faces without a
  // triangle get their pins, or points of their neighbours. Certified, with what `request` asks for
  // in terms of the input; not agreed with storage where the solution was not.
  Parametrization on_input(const Parametrization& solved, const CertifyRequest& request,
                           const ExecutionContext& context) const;

 private:
  const mesh::Surface& input_;
  mesh::SeparatedSurface separated_;
  mesh::Surface rest_;
};

}  // namespace flipfree::certify
