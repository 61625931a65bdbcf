#include "physics/bodies/articulation.hpp"

#include "energymargin/kinematics.hpp"

namespace energymargin {

Articulation::Articulation(const Scene& scene, std::size_t base, std::optional<std::size_t> first,
                           std::vector<btTransform>& poses)
    : scene_(scene), layout_(scene), poses_(poses), free_(!scene.bodies()[base].fixed()) {
  const Body& root = scene.bodies()[base];
  links_.push_back({base});
  Link& made = links_.back();
  made.mass = root.dynamic() ? root.mass : 0.0;  // a fixed base, or one that no force moves, takes part in nothing
  made.moments = to_bullet(scene_.inertial(base).moments);
  made.pose = bullet_pose(scene_.inertial(base), root.state);
  for (int i = 0; free_ && i < velocities_of_free_body; ++i) add_velocity(made);
  add_links(base, 0, first);
  motions_.resize(count());
  ways_.resize(count());
  for (int i = 1; i < static_cast<int>(links_.size()); ++i) {
    const Joint& joint = scene.joints()[*link(i).joint];
    if (link(i).velocity >= 0 && !joint.mimic)
      controls_.push_back({{&joint, joint.target}, &joint, i, link(i).velocity});
  }
  for (const JointControl& control : controls_) drives_ = drives_ || control.law->drives();
  inertia_.resize(count() * count(), 0.0);
  for (std::vector<double>* numbers : {&forces_, &bias_, &rates_, &coasting_, &kicked_}) numbers->resize(count());
  for (auto* of_links : {&bodies_, &composites_}) of_links->resize(links_.size());
  for (auto* of_links : {&accelerations_, &link_forces_}) of_links->resize(links_.size());
}

void Articulation::add_links(std::size_t parent, int parent_link, std::optional<std::size_t> only) {
  const std::vector<Joint>& joints = scene_.joints();
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (joints[i].parent != scene_.bodies()[parent].name || (only && *only != i)) continue;
    links_.push_back(make_link(i, parent_link));
    if (!scene_.rigid(joints[i])) add_velocity(links_.back());
    add_links(links_.back().body, static_cast<int>(links_.size()) - 1, std::nullopt);
  }
}

Articulation::Link Articulation::make_link(std::size_t joint, int parent_link) const {
  const Joint& on = scene_.joints()[joint];
  const Link& parent = link(parent_link);
  Link made{scene_.index(on.child), parent_link, joint, on.type == JointType::prismatic};
  made.last_velocity = parent.last_velocity;
  made.mass = scene_.bodies()[made.body].mass;
  made.armature = on.armature;
  const Inertial& of_parent = scene_.inertial(parent.body);
  const Inertial& of_child = scene_.inertial(made.body);
  const Quaternion from_child = of_child.axes.conjugate();
  made.moments = to_bullet(of_child.moments);
  made.turn = btMatrix3x3(to_bullet(Quaternion(of_parent.axes.conjugate() * on.in_parent.orientation *
                                               on.in_child.orientation.conjugate() * of_child.axes)));
  made.axis = to_bullet(Vector3(from_child * (on.in_child.orientation * on.axis)));
  made.pivot = to_bullet(Vector3(of_parent.axes.conjugate() * (on.in_parent.position - of_parent.center)));
  made.arm = to_bullet(Vector3(from_child * (of_child.center - on.in_child.position)));
  return made;
}

void Articulation::add_velocity(Link& link) {
  above_.push_back(link.last_velocity);
  movers_.push_back(links_.size() - 1);
  link.velocity = link.last_velocity = static_cast<int>(count());
  velocities_.push_back(0.0);
}

void Articulation::put(const State& state) {
  Link& base = links_.front();
  if (free_) {
    const BodyState frame = StateLayout::read(state.data() + layout_.offset(base.body));
    const BodyState center = state_at_point(scene_.inertial(base.body).center, frame);
    base.pose = bullet_pose(scene_.inertial(base.body), frame);
    Eigen::Map<Vector3>(velocities_.data()) = center.velocity;
    Eigen::Map<Vector3>(velocities_.data() + 3) = center.angular_velocity;
  }
  for (std::size_t i = 1; i < links_.size(); ++i) {
    const JointState at = layout_.joint(state.data(), *links_[i].joint);
    links_[i].position = at.position;
    if (links_[i].velocity >= 0) velocities_[static_cast<std::size_t>(links_[i].velocity)] = at.velocity;
  }
  place_links();
  place_bodies();
}

void Articulation::forget() {
  for (JointControl& control : controls_) control.target = control.joint->target;
  clear_loads();
}

void Articulation::read(State& state) const {
  const Link& base = links_.front();
  if (free_) {
    const Eigen::Map<const Vector3> linear(velocities_.data()), angular(velocities_.data() + 3);
    StateLayout::write(frame_state(scene_.inertial(base.body), base.pose, linear, angular),
                       state.data() + layout_.offset(base.body));
  }
  for (std::size_t i = 1; i < links_.size(); ++i) {
    const int offset = layout_.joint_offset(*links_[i].joint);
    if (offset < 0) continue;
    const int velocity = links_[i].velocity;
    state[offset] = links_[i].position;
    state[offset + 1] = velocity >= 0 ? velocities_[static_cast<std::size_t>(velocity)] : 0.0;
  }
}

void Articulation::place_links() {
  for (std::size_t i = 1; i < links_.size(); ++i) {
    Link& link = links_[i];
    const btTransform& parent = this->link(link.parent).pose;
    link.hinge = parent(link.pivot);
    btMatrix3x3 axes = parent.getBasis() * link.turn;
    btVector3 arm = link.arm;
    if (link.slides) {
      arm += link.axis * link.position;
    } else if (link.position != 0.0) {
      axes *= btMatrix3x3(turned_about(link.axis, link.position));
    }
    link.pose = btTransform(axes, link.hinge + axes * arm);
  }
  set_motions();
}

void Articulation::place_bodies() {
  for (std::size_t i = free_ ? 0 : 1; i < links_.size(); ++i) poses_[links_[i].body] = links_[i].pose;
}

void Articulation::set_motions() {
  for (std::size_t axis = 0; free_ && axis < 3; ++axis) {
    motions_[axis].linear[static_cast<int>(axis)] = 1.0;
    motions_[3 + axis].angular[static_cast<int>(axis)] = 1.0;
  }
  for (std::size_t i = 1; i < links_.size(); ++i) {
    const Link& link = links_[i];
    if (link.velocity < 0) continue;
    const btVector3 axis = link.pose.getBasis() * link.axis;
    motions_[static_cast<std::size_t>(link.velocity)] =
        link.slides ? SpatialVector{btVector3(0, 0, 0), axis} : SpatialVector{axis, axis.cross(origin() - link.hinge)};
  }
}

const std::vector<SpatialVector>& Articulation::link_motions(const std::vector<double>& velocities) const {
  link_motions_.assign(links_.size(), {});
  if (free_) link_motions_[0] = {vector(velocities.data() + 3), vector(velocities.data())};
  for (std::size_t i = 1; i < links_.size(); ++i) {
    link_motions_[i] = link_motions_[static_cast<std::size_t>(links_[i].parent)];
    if (links_[i].velocity < 0) continue;
    const auto velocity = static_cast<std::size_t>(links_[i].velocity);
    link_motions_[i] += motions_[velocity] * velocities[velocity];
  }
  return link_motions_;
}

void Articulation::read(const std::vector<double>& from, std::vector<Velocity>& velocities) const {
  const std::vector<SpatialVector>& motions = link_motions(from);
  for (std::size_t i = free_ ? 0 : 1; i < links_.size(); ++i) {
    const btVector3 arm = links_[i].pose.getOrigin() - origin();
    velocities[links_[i].body] = {motions[i].linear + motions[i].angular.cross(arm), motions[i].angular};
  }
}

btVector3 Articulation::velocity(int link, const btVector3& point, const std::vector<double>& velocities) const {
  const SpatialVector& motion = link_motions(velocities)[static_cast<std::size_t>(link)];
  return motion.linear + motion.angular.cross(point - origin());
}

double Articulation::fastest_turn(const std::vector<double>& velocities) const {
  double fastest = 0.0;
  for (const SpatialVector& motion : link_motions(velocities)) fastest = std::max(fastest, motion.angular.length());
  return fastest;
}

void Articulation::apply(int link, const btVector3& force, const btVector3& torque) {
  links_[static_cast<std::size_t>(link)].force += force;
  links_[static_cast<std::size_t>(link)].torque += torque;
}

void Articulation::clear_loads() {
  for (Link& link : links_) link.force = link.torque = btVector3(0, 0, 0);
}

void Articulation::move(double duration, double share) {
  if (free_) {
    const double moved = kinematic() ? duration : share * duration;
    btTransform& pose = links_.front().pose;
    pose = moved_pose(pose, vector(ways_.data()) * moved, vector(ways_.data() + 3) * moved);
  }
  for (Link& link : links_) {
    if (link.joint && link.velocity >= 0) {
      link.position += share * duration * ways_[static_cast<std::size_t>(link.velocity)];
    }
  }
  place_links();
  place_bodies();
}

void Articulation::put_base(const btTransform& pose) {
  links_.front().pose = pose;
  place_links();
  place_bodies();
}

void Articulation::put_off(const std::vector<double>& way) {
  if (positions_.empty()) {
    base_pose_ = links_.front().pose;
    for (const Link& link : links_) positions_.push_back(link.position);
  }
  if (free_) links_.front().pose = moved_pose(base_pose_, vector(way.data()), vector(way.data() + 3));
  for (std::size_t i = 1; i < links_.size(); ++i) {
    if (links_[i].velocity < 0) continue;
    links_[i].position = positions_[i] + way[static_cast<std::size_t>(links_[i].velocity)];
  }
  place_links();
}

void Articulation::look_ahead(double duration) {
  std::vector<double> way = ways_;
  for (double& along : way) along *= duration;
  put_off(way);
}

void Articulation::put_back() {
  links_.front().pose = base_pose_;
  for (std::size_t i = 1; i < links_.size(); ++i) links_[i].position = positions_[i];
  positions_.clear();
  place_links();
}

std::vector<double> Articulation::loads(const btVector3& gravity) const {
  std::vector<double> loads(count(), 0.0);
  for (std::size_t i = free_ ? 0 : 1; i < links_.size(); ++i) {
    const Link& link = links_[i];
    const btVector3 force = gravity * link.mass + link.force;
    const btVector3 arm = link.pose.getOrigin() - origin();
    add(static_cast<int>(i), {arm.cross(force) + link.torque, force}, loads.data());
  }
  return loads;
}

}  // namespace energymargin
