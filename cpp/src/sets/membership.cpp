#include "energymargin/membership.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "base/angles.hpp"
#include "energymargin/kinematics.hpp"

namespace energymargin {
namespace {

constexpr double straight = 1000.0;  // radius from which on a path counts as straight [m]

using Test = std::function<bool(const double*)>;

// Reads one body out of a state vector.
class BodyReader {
 public:
  BodyReader(const Scene& scene, std::shared_ptr<const Kinematics> kinematics, const std::string& name)
      : kinematics_(std::move(kinematics)), body_(scene.index(name)) {}

  BodyState operator()(const double* state) const { return (*kinematics_)(state, body_); }

 private:
  std::shared_ptr<const Kinematics> kinematics_;
  std::size_t body_;
};

// A body as seen from a frame: that of another body or, without a name, the world's.
class RelativeReader {
 public:
  RelativeReader(const Scene& scene, const std::shared_ptr<const Kinematics>& kinematics, const std::string& body,
                 const std::string& frame)
      : body_(scene, kinematics, body), in_world_(frame.empty()), frame_(scene, kinematics, in_world_ ? body : frame) {}

  Vector3 position(const double* state) const {
    const Vector3 position = body_(state).position;
    if (in_world_) return position;
    const BodyState frame = frame_(state);
    return frame.orientation.conjugate() * (position - frame.position);
  }

  //! Of the frame's body, in its own axes.
  Vector3 frame_velocity(const double* state) const {
    const BodyState frame = frame_(state);
    return frame.orientation.conjugate() * frame.velocity;
  }

  Vector3 direction(const double* state, const Vector3& axis) const {
    const Vector3 direction = body_(state).orientation * axis;
    return in_world_ ? direction : Vector3(frame_(state).orientation.conjugate() * direction);
  }

  //! Velocity of a point of the body, as seen by somebody who moves with the frame.
  Vector3 velocity(const double* state, const Vector3& point, bool along_world) const {
    const BodyState body = body_(state);
    const Vector3 arm = along_world ? point : Vector3(body.orientation * point);
    const Vector3 velocity = body.velocity + body.angular_velocity.cross(arm);
    if (in_world_) return velocity;
    const BodyState frame = frame_(state);
    const Vector3 velocity_of_frame =
        frame.velocity + frame.angular_velocity.cross(body.position + arm - frame.position);
    return frame.orientation.conjugate() * (velocity - velocity_of_frame);
  }

 private:
  BodyReader body_;
  bool in_world_;
  BodyReader frame_;
};

bool in_sector(const regions::AnnularSector& sector, const Vector3& position) {
  const Vector2 arm = position.head<2>() - sector.center;
  if (std::abs(arm.norm() - sector.radius) > sector.half_width) return false;
  const double direction = sector.sweep < 0.0 ? -1.0 : 1.0;
  const double turned = direction * (std::atan2(arm.y(), arm.x()) - sector.start_angle);
  return turned - full_turn * std::floor(turned / full_turn) <= std::abs(sector.sweep);
}

bool in_sweep(const regions::Swept& swept, const regions::PlanarMotion& motion, const Vector3& position) {
  const double speed = motion.velocity.norm();
  if (speed < swept.least_speed || speed == 0.0) {
    return (position.head<2>() - motion.position).norm() <= swept.disc_radius;
  }
  const double turn = motion.yaw_rate < 0.0 ? -1.0 : 1.0;  // 1: the centre is on the left of the motion
  const double radius = speed / std::max(std::abs(motion.yaw_rate), speed / straight);
  const Vector2 outwards = turn / speed * Vector2(motion.velocity.y(), -motion.velocity.x());
  regions::AnnularSector sector;
  sector.center = motion.position - radius * outwards;
  sector.radius = radius;
  sector.half_width = swept.half_width;
  sector.start_angle = std::atan2(outwards.y(), outwards.x()) - turn * swept.behind / radius;
  sector.sweep = turn * std::min((swept.behind + swept.ahead * speed + swept.beyond) / radius, full_turn);
  return in_sector(sector, position);
}

regions::PlanarMotion planar_motion(const BodyState& body) {
  return {body.position.head<2>(), body.velocity.head<2>(), body.angular_velocity.z()};
}

class Compiler {
 public:
  explicit Compiler(const Scene& scene)
      : scene_(scene), kinematics_(std::make_shared<Kinematics>(scene)), size_(StateLayout(scene).dimension()) {}

  Test compile(const Region& region) const { return std::visit(*this, region.expression()); }

  Test operator()(const regions::Ball& ball) const {
    return [ball, body = reader(ball)](const double* state) {
      return (body.position(state) - ball.center).squaredNorm() <= ball.radius * ball.radius;
    };
  }
  Test operator()(const regions::Box& box) const {
    return [box, body = reader(box)](const double* state) {
      return ((body.position(state) - box.center).array().abs() <= 0.5 * box.size.array()).all();
    };
  }
  Test operator()(const regions::Disc& disc) const {
    return [disc, body = reader(disc)](const double* state) {
      return (body.position(state).head<2>() - disc.center).squaredNorm() <= disc.radius * disc.radius;
    };
  }
  Test operator()(const regions::AnnularSector& sector) const {
    return [sector, body = reader(sector)](const double* state) { return in_sector(sector, body.position(state)); };
  }
  Test operator()(const regions::Swept& swept) const {
    return [swept, body = BodyReader(scene_, kinematics_, swept.body),
            by = BodyReader(scene_, kinematics_, swept.by)](const double* state) {
      return in_sweep(swept, swept.at ? *swept.at : planar_motion(by(state)), body(state).position);
    };
  }
  Test operator()(const regions::HalfSpace& half_space) const {
    return [half_space, body = reader(half_space)](const double* state) {
      const double beyond = half_space.normal.dot(body.position(state)) - half_space.offset;
      if (half_space.ahead == 0.0 || beyond <= 0.0) return beyond <= 0.0;
      return beyond <= half_space.ahead * half_space.normal.dot(body.frame_velocity(state));
    };
  }
  Test operator()(const regions::Speed& speed) const {
    return [speed, body = reader(speed)](const double* state) {
      const Vector3 velocity = body.velocity(state, speed.point, speed.along_world);
      if (speed.along) return velocity.dot(*speed.along) <= speed.limit;
      return velocity.squaredNorm() <= speed.limit * speed.limit;
    };
  }
  Test operator()(const regions::Tilt& tilt) const {
    return [tilt, body = reader(tilt)](const double* state) {
      const Vector3 direction = body.direction(state, tilt.axis);
      return std::atan2(direction.cross(tilt.reference).norm(), direction.dot(tilt.reference)) <= tilt.limit;
    };
  }
  Test operator()(const regions::Predicate& predicate) const {
    return [predicate, size = size_](const double* state) {
      const Mask mask = predicate.contains(Eigen::Map<const States>(state, 1, size));
      return static_cast<bool>(mask(0));
    };
  }
  Test operator()(const regions::Intersection& all) const {
    return [tests = compile_each(all.of)](const double* state) {
      return std::all_of(tests.begin(), tests.end(), [state](const Test& test) { return test(state); });
    };
  }
  Test operator()(const regions::Union& any) const {
    return [tests = compile_each(any.of)](const double* state) {
      return std::any_of(tests.begin(), tests.end(), [state](const Test& test) { return test(state); });
    };
  }
  Test operator()(const regions::Complement& negated) const {
    return [test = compile(negated.of.front())](const double* state) { return !test(state); };
  }

 private:
  template <typename Primitive>
  RelativeReader reader(const Primitive& primitive) const {
    return {scene_, kinematics_, primitive.body, primitive.frame};
  }

  std::vector<Test> compile_each(const std::vector<Region>& regions) const {
    std::vector<Test> tests;
    for (const Region& region : regions) tests.push_back(compile(region));
    return tests;
  }

  const Scene& scene_;
  std::shared_ptr<const Kinematics> kinematics_;
  int size_;
};

}  // namespace

Membership::Membership(const Region& region, const Scene& scene) : test_(Compiler(scene).compile(region)) {
  if (const auto* predicate = std::get_if<regions::Predicate>(&region.expression())) test_all_ = predicate->contains;
}

Mask Membership::operator()(const States& states) const {
  if (test_all_) return test_all_(states);
  Mask mask(states.rows());
  for (Eigen::Index i = 0; i < states.rows(); ++i) mask(i) = test_(states.row(i).data());
  return mask;
}

}  // namespace energymargin
