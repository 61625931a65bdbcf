#include "bounds/cell_tree.hpp"

namespace energymargin::bounds {

CellTree::CellTree(const Landscape& landscape, const PoseCell& domain)
    : landscape_(landscape), full_turn_(domain.high[turn_axis] > domain.low[turn_axis]) {
  cells_.push_back(cell(domain));
}

double CellTree::width_along(const PoseCell& poses, int axis) const {
  const double half = 0.5 * (poses.high[axis] - poses.low[axis]);
  return axis == turn_axis ? half * landscape_.space.radius() : half;
}

int CellTree::widest_axis(const PoseCell& poses) const {
  int widest = 0;
  for (int axis = 1; axis <= turn_axis; ++axis) {
    if (width_along(poses, axis) > width_along(poses, widest)) widest = axis;
  }
  return widest;
}

double CellTree::width(int cell) const {
  const PoseCell& poses = (*this)[cell].poses;
  return width_along(poses, widest_axis(poses));
}

Cell CellTree::cell(const PoseCell& poses) const {
  Cell made;
  made.poses = poses;
  made.occupancy = landscape_.obstacles.occupancy(poses);
  if (made.occupancy.blocked) return made;
  made.potential = landscape_.potential(poses);
  made.exit = landscape_.exit.crossing(poses).outside;
  return made;
}

void CellTree::split(int cell) {
  const PoseCell whole = (*this)[cell].poses;
  const int axis = widest_axis(whole);
  const double middle = 0.5 * (whole.low[axis] + whole.high[axis]);
  PoseCell lower = whole, upper = whole;
  lower.high[axis] = upper.low[axis] = middle;
  cells_[static_cast<std::size_t>(cell)].children = size();
  cells_.push_back(this->cell(lower));
  cells_.push_back(this->cell(upper));
}

int CellTree::leaf_at(const Coordinates& at) const {
  int cell = 0;
  while (!leaf(cell)) {
    const PoseCell& lower = (*this)[(*this)[cell].children].poses;
    cell = (*this)[cell].children + ((at.array() <= lower.high.array()).all() ? 0 : 1);
  }
  return cell;
}

void CellTree::neighbours(int cell, std::vector<int>& found) const {
  found.clear();
  const PoseCell& poses = (*this)[cell].poses;
  touching(0, poses, cell, found);
  if (!full_turn_) return;
  const PoseCell& all = (*this)[0].poses;
  for (const bool upper : {true, false}) {
    const bool at_end =
        upper ? poses.high[turn_axis] == all.high[turn_axis] : poses.low[turn_axis] == all.low[turn_axis];
    if (!at_end) continue;
    PoseCell around = poses;
    around.low[turn_axis] = around.high[turn_axis] = upper ? all.low[turn_axis] : all.high[turn_axis];
    touching(0, around, cell, found);
  }
}

// Cells that meet at an edge or a corner alone are left out: their neighbours there share a face with both, and are
// blocked only if the edge is.
void CellTree::touching(int at, const PoseCell& poses, int except, std::vector<int>& found) const {
  const PoseCell& other = (*this)[at].poses;
  int faces = 0;
  for (int axis = 0; axis <= turn_axis; ++axis) {
    const double low = std::max(poses.low[axis], other.low[axis]);
    const double high = std::min(poses.high[axis], other.high[axis]);
    if (low > high) return;
    faces += low == high && other.low[axis] < other.high[axis];
  }
  if (faces > 1) return;
  if (!leaf(at)) {
    touching((*this)[at].children, poses, except, found);
    touching((*this)[at].children + 1, poses, except, found);
  } else if (at != except && !(*this)[at].occupancy.blocked) {
    found.push_back(at);
  }
}

}  // namespace energymargin::bounds
