#pragma once
// Contacts of two solids whose faces or lines may lie on one another.

#include <btBulletDynamicsCommon.h>

#include <vector>

#include "physics/contacts/gjk.hpp"
#include "physics/contacts/solid_pair.hpp"

namespace energymargin {

//! The corners of what two faces share, or the ends of what two lines or a line and a face do.
class FaceContacts {
 public:
  //! Adds those that are within `reach` [m] to `result`. `normal` is the unit vector from b to a. Of each solid those
  //! corners count that are within `depth` [m] of its farthest point along the normal. Returns how many it added.
  int add(const SolidPair& solids, const btTransform& pose_a, const btTransform& pose_b, const btVector3& normal,
          double depth, double reach, GjkResult& result);

  //! A corner, in the plane of contact and along its normal [m].
  struct Corner {
    double x, y, height;
  };

  //! In counter-clockwise order: a face; two corners: a line; one: a point.
  using Face = std::vector<Corner>;

 private:
  Face a_, b_, shared_, scratch_;
};

}  // namespace energymargin
