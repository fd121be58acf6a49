// Errors of a part, or of a refined map, with the places of the caller's mesh.
#pragma once

#include <vector>

#include "flipfree/base/error.h"

namespace flipfree::seamless {

// `faces`, `vertices`: the caller's number of each of those that the error counts; elements beyond
// are left out, corners become faces. Each is named once, but for the ends of edges.
Error placed_in(Error error, const std::vector<FaceId>& faces,
                const std::vector<VertexId>& vertices);

// To be called in a catch block: throws the exception at hand again, NotConverged (a failed
// certificate too) with its places; others as they are.
[[noreturn]] void rethrow_placed(const std::vector<FaceId>& faces,
                                 const std::vector<VertexId>& vertices);

}  // namespace flipfree::seamless
