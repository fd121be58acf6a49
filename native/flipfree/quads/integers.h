// Integers for the edges of a coarse surface: the same flat surface, by a small change of its
// shape, as one of whole squares.
//
// Unknown is a Gaussian integer for every edge, in the chart of its face, with the map's quarter
// turns; triangles close, edges of borders and features keep their axis, every area is positive and
// every vertex has its angle: then no cone, corner or border is merged with another, and the area
// of the surface is the number of quads. Edges are rounded; what triangles then lack is sent along
// cheapest dual paths from one to another, a unit turning with the charts that it passes; then
// closed dual paths that lower the energy, symmetric Dirichlet of the change of shape, are applied
// as long as there are any (cancelling of negative cycles). No solver, no tolerance: whatever is
// tried, the conditions are kept in integers.
//
// Deviations from Bommes, Campen, Ebke, Alliez, Kobbelt, "Integer-Grid Maps for Reliable Quad
// Meshing" (2013), Campen, Bommes, Kobbelt, "Quantized Global Parametrization" (2015), and
// Heistermann, Warnett, Bommes, "Min-Deviation-Flow in Bi-directed Graphs for T-Mesh Quantization"
// (2023): no motorcycle graph and no T-mesh; lengths of arcs become vectors of edges, flow in a
// network becomes flow in the dual of a triangulation times the four directions.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/quads/coarse.h"

namespace flipfree::quads {

// Chooses the integers of a surface in which a length 1 of component c is scale[c] quads;
// `component`: per face. `count`: how many quads there shall be, for whose sake lengths give way
// where that costs least; 0: as many as come out. Valid integers that are there already, of about
// that scale, are what it begins at; else it rounds. Flips
// edges so that triangles are well shaped in the new metric; areas stay positive by the edges and
// by the integers. False if no integers with positive areas were found. `map` as of flip_coarse(),
// `quarters` as of coarse_surface(). Throws Cancelled, TimeIsOver.
bool choose_integers(CoarseSurface& coarse, const FlatSurface& map,
                     const std::vector<Index>& quarters, const std::vector<Index>& component,
                     const std::vector<double>& scale, double count, ExecutionContext& context);

// Twice the area of all triangles by their integers: twice the number of quads.
std::int64_t twice_area_in_quads(const CoarseSurface& coarse);

}  // namespace flipfree::quads
