// The certificate of a finished map: what every operator asks for before it returns one.
#pragma once

#include <string>
#include <utility>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/certify/certificate.h"
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

// Throws CertificateFailed unless map.certificate.ok; `what` names the operation, e.g. "The
// unwrap".
void require_certificate(const Parametrization& map, const char* what);

}  // namespace flipfree::certify
