// The certificate of a finished map: what every operator asks for before it returns one.
#pragma once

#include <string>
#include <utility>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/certify/certify.h"
#include "flipfree/certify/parametrization.h"

namespace flipfree::certify {

// Fills map.certificate for a finished map (surface, uv, uv32, provenance); `input` is the user's
// surface.
void certify_map(Parametrization& map, const mesh::Surface& input, const CertifyRequest& extra,
                 const ExecutionContext& context);

// A finished map that did not pass: carries what was measured.
class CertificateFailed : public NotConverged {
 public:
  CertificateFailed(const std::string& what, Certificate certificate);
  CertificateFailed(Error error, Certificate certificate)
      : NotConverged(std::move(error)), certificate_(std::move(certificate)) {}
  const Certificate& certificate() const { return certificate_; }

 private:
  Certificate certificate_;
};

// The map's certificate with failed_faces as faces of the input, as the caller never sees a refined
// mesh that failed. A sentence says so if the failures' texts number other faces.
Certificate in_input_faces(const Parametrization& map);
// That sentence, once.
void note_refined_numbers(Certificate& certificate);

// Throws CertificateFailed unless map.certificate.ok; `what` names the operation, e.g. "The
// unwrap".
void require_certificate(const Parametrization& map, const char* what);

// One map in 64 bits that plain rounding takes to the stored one.
//
// Where rounding to 32 bits would have folded a triangle, the stored values are others than the
// nearest to the solver's. Whoever rounds the solver's values himself gets the fold back.

// Sets map.agreed for a map whose certificate for `request` is ok: empty if map.uv rounds to
// map.uv32 everywhere. Else the solver's values, with the stored ones wherever they do not round to
// these; or, where that does not pass the same certificate, or angles are prescribed, the stored
// values alone. Should these not pass either (an infinite energy), map.certificate says so. Cost:
// O(#F); a second certificate where rounding was repaired.
void agree_with_storage(Parametrization& map, const CertifyRequest& request,
                        const ExecutionContext& context);

}  // namespace flipfree::certify
