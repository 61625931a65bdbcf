#pragma once
// Bullet's world with the scene's coefficients, and the residual that its solver leaves.

#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>

#include "physics/contacts/collision_filter.hpp"
#include "physics/contacts/face_contacts.hpp"
#include "physics/motion.hpp"

namespace energymargin {

//! The index in the scene of what Bullet collides.
inline std::size_t body_of(const btCollisionObject& object) { return static_cast<std::size_t>(object.getUserIndex()); }

//! The scene's filter for Bullet's broadphase. The scene outlives this.
struct OverlapFilter : btOverlapFilterCallback {
  explicit OverlapFilter(const Scene& scene) : can_collide(scene) {}

  bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override {
    const auto body = [](const btBroadphaseProxy& proxy) {
      return body_of(*static_cast<const btCollisionObject*>(proxy.m_clientObject));
    };
    return can_collide(body(*a), body(*b));
  }

  CollisionFilter can_collide;
};

//! Bullet's solver; of all islands of a step, the largest residual that is left.
class ResidualSolver : public btMultiBodyConstraintSolver {
 public:
  double residual = 0.0;

 protected:
  btScalar solveGroupCacheFriendlyIterations(btCollisionObject** bodies, int body_count,
                                             btPersistentManifold** manifolds, int manifold_count,
                                             btTypedConstraint** constraints, int constraint_count,
                                             const btContactSolverInfo& info, btIDebugDraw* drawer) override {
    const btScalar result = btMultiBodyConstraintSolver::solveGroupCacheFriendlyIterations(
        bodies, body_count, manifolds, manifold_count, constraints, constraint_count, info, drawer);
    residual = std::max(residual, static_cast<double>(m_leastSquaresResidual));
    return result;
  }
};

//! Contacts have the coefficients of the scene, whatever Bullet makes of the bodies' own.
class SceneWorld : public btMultiBodyDynamicsWorld {
 public:
  SceneWorld(const Scene& scene, btDispatcher& dispatcher, btBroadphaseInterface& broadphase, ResidualSolver& solver,
             btCollisionConfiguration& configuration)
      : btMultiBodyDynamicsWorld(&dispatcher, &broadphase, &solver, &configuration), scene_(scene) {}

  void performDiscreteCollisionDetection() override {
    btMultiBodyDynamicsWorld::performDiscreteCollisionDetection();
    for (int i = 0; i < getDispatcher()->getNumManifolds(); ++i) {
      btPersistentManifold& manifold = *getDispatcher()->getManifoldByIndexInternal(i);
      const std::size_t a = body_of(*manifold.getBody0()), b = body_of(*manifold.getBody1());
      const Surface surface = scene_.contact_surface(a, b);
      const double of_patch = scene_.contact_friction(a, b) * grip_share * surface.patch_radius;
      for (int k = 0; k < manifold.getNumContacts(); ++k) {
        btManifoldPoint& point = manifold.getContactPoint(k);
        point.m_combinedFriction = scene_.contact_friction(a, b);
        point.m_combinedRollingFriction = surface.rolling_friction;
        point.m_combinedSpinningFriction = std::max(surface.torsional_friction, of_patch);
        point.m_combinedRestitution = surface.restitution;
        if (surface.stiffness == 0.0) continue;
        point.m_contactPointFlags |= BT_CONTACT_FLAG_CONTACT_STIFFNESS_DAMPING;
        point.m_combinedContactStiffness1 = surface.stiffness;
        point.m_combinedContactDamping1 = surface.damping;
      }
    }
  }

 private:
  const Scene& scene_;
};

//! A motor of a free body: six rows that give it velocities within limits of force and torque.
class BulletMotor : public btTypedConstraint {
 public:
  BulletMotor(btRigidBody& body, const Motor& motor) : btTypedConstraint(D6_CONSTRAINT_TYPE, body), motor_(motor) {}

  void getInfo1(btConstraintInfo1* info) override {
    info->m_numConstraintRows = velocities_of_free_body;
    info->nub = 0;
  }
  void getInfo2(btConstraintInfo2* info) override {
    const double duration = 1.0 / info->fps;
    for (int axis = 0; axis < velocities_of_free_body; ++axis) {
      const int row = axis * info->rowskip;
      btScalar* const jacobian = axis < 3 ? info->m_J1linearAxis : info->m_J1angularAxis;
      jacobian[row + axis % 3] = 1.0;
      info->m_constraintError[row] = motor_.velocity[axis];
      const double most = std::min((axis < 3 ? motor_.force : motor_.torque) * duration, most_impulse);
      info->m_lowerLimit[row] = -most;
      info->m_upperLimit[row] = most;
    }
  }
  void setParam(int, btScalar, int) override {}
  btScalar getParam(int, int) const override { return 0.0; }

 private:
  static constexpr double most_impulse = 1e10;  // N s
  Motor motor_;
};

}  // namespace energymargin
