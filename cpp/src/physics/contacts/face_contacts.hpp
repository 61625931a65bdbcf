#pragma once
// Contacts of two solids whose faces or lines may lie on one another.

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "physics/contacts/outlines.hpp"
#include "physics/contacts/solid_pair.hpp"

namespace energymargin {

//! Round faces carry their load at the rim and rub at this share of its radius, as if pressed evenly.
inline constexpr double grip_share = 2.0 / 3.0;

//! A corner of what two faces share.
struct FacePoint {
  btVector3 on_b;
  btVector3 grip;      // where its friction acts
  double distance;     // [m]
  double lever = 0.0;  // of its friction about `grip`, where that acts over a patch [m]
};

//! Where one looks for contacts of two bodies.
struct ContactReach {
  double depth;        // along the normal, of the corners of one face: bodies that are nearer have contacts [m]
  double early;        // if above 0, bodies that are so near have contacts too, before they touch [m]
  bool compliant;      // whether the bodies may be pressed in by more than their margins
  double patch = 0.0;  // if above 0, the least radius of the patch on which friction acts [m]

  double reach() const { return std::max(depth, early); }
};

//! The corners of what two faces share, or the ends of what two lines or a line and a face do.
class FaceContacts {
 public:
  //! All contacts of two solids within `near.reach()`, from where they stand alone: the points of their faces, and the
  //! closest points where those miss them. `normal` becomes theirs, from b to a.
  const std::vector<FacePoint>& contacts(SolidPair& solids, const btTransform& pose_a, const btTransform& pose_b,
                                         const ContactReach& near, btVector3& normal);

  //! Those that are within `near.reach()`. `normal` is the unit vector from b to a. Of each solid those corners count
  //! that are within `near.depth` of its farthest point along the normal.
  const std::vector<FacePoint>& find(const SolidPair& solids, const btTransform& pose_a, const btTransform& pose_b,
                                     const btVector3& normal, const ContactReach& near);

  //! An edge near which contacts are: solids overlap by so much [m] across it, along a unit vector from b to a.
  struct Edge {
    btVector3 across;
    double overlap;
  };

  //! Those of the last `contacts`, and its edge.
  const std::vector<FacePoint>& points() const { return points_; }
  const std::optional<Edge>& edge() const { return edge_; }

 private:
  // Finds those of solids with sharp edges from the closest points of rounded ones, whose normal is `normal` before.
  void find_sharp(SolidPair& solids, const btTransform& pose_a, const btTransform& pose_b, const ClosestPoints& closest,
                  const ContactReach& near, btVector3& normal);
  // Adds corners that are not of the faces, before they touch the other solid's face.
  void add_corners(const SolidPair& solids, const btTransform& pose_a, const btTransform& pose_b,
                   const btVector3& normal, const ContactReach& near);
  // Sets the outermost faces along a normal, as far as they are within `depth`. Whether each is a whole round one.
  std::pair<bool, bool> find_faces(const SolidPair& solids, const btTransform& pose_a, const btTransform& pose_b,
                                   const outlines::ContactPlane& plane, double depth);
  void move_grips();
  double least_distance() const;  // of the points
  // Finds the faces as near to a normal as that cosine. Whether one has it.
  bool find_axes(const SolidPair& solids, const btTransform& pose_a, const btTransform& pose_b,
                 const ClosestPoints& closest, double near);
  // Of a normal and those faces that along which the solids are farthest apart with sharp corners.
  btVector3 farthest_axis(const SolidPair& solids, const btTransform& pose_a, const btTransform& pose_b,
                          const btVector3& normal) const;
  // Of those faces that across the normal along which they overlap least.
  std::optional<Edge> next_face(const SolidPair& solids, const btTransform& pose_a, const btTransform& pose_b,
                                const btVector3& normal) const;
  Edge edge_of(const SolidPair& solids, const btTransform& pose_a, const btTransform& pose_b, const btVector3& normal,
               const btVector3& slanted) const;

  std::optional<Edge> edge_;
  outlines::Face a_, b_, shared_, scratch_;
  std::vector<double> angles_;
  // A face's normal, from b to a, and the most that the solids can be apart along it: the height of the other's closest
  // point above the face [m].
  struct Axis {
    btVector3 normal;
    double most;
  };

  std::vector<Axis> faces_;
  std::vector<FacePoint> points_;
};

}  // namespace energymargin
