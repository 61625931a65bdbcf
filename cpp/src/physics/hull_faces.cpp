// Bullet's exact hull computer.

#include "scene/hull_faces.hpp"

#include <LinearMath/btConvexHullComputer.h>

namespace energymargin {

std::vector<std::array<std::size_t, 3>> hull_faces(const std::vector<Vector3>& points) {
  btConvexHullComputer hull;
  hull.compute(points.front().data(), sizeof(Vector3), static_cast<int>(points.size()), 0.0, 0.0);
  const auto vertex = [&](int i) { return static_cast<std::size_t>(hull.original_vertex_index[i]); };
  std::vector<std::array<std::size_t, 3>> triangles;
  for (int face = 0; face < hull.faces.size(); ++face) {
    const btConvexHullComputer::Edge* first = &hull.edges[hull.faces[face]];
    const int corner = first->getSourceVertex();
    for (const auto* edge = first->getNextEdgeOfFace(); edge->getTargetVertex() != corner;
         edge = edge->getNextEdgeOfFace()) {
      triangles.push_back({vertex(corner), vertex(edge->getSourceVertex()), vertex(edge->getTargetVertex())});
    }
  }
  return triangles;
}

}  // namespace energymargin
