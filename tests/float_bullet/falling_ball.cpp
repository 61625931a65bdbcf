// A ball falls on a plane in single-precision Bullet.

#include <btBulletDynamicsCommon.h>

static_assert(sizeof(btScalar) == sizeof(float));

double resting_height() {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.setGravity({0, 0, -10});
  btStaticPlaneShape plane({0, 0, 1}, 0);
  btRigidBody ground(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &plane));
  btSphereShape sphere(0.5f);
  btVector3 inertia;
  sphere.calculateLocalInertia(1, inertia);
  btRigidBody ball(btRigidBody::btRigidBodyConstructionInfo(1, nullptr, &sphere, inertia));
  ball.setWorldTransform(btTransform(btQuaternion::getIdentity(), {0, 0, 2}));
  world.addRigidBody(&ground);
  world.addRigidBody(&ball);
  for (int i = 0; i < 1000; ++i) world.stepSimulation(1.0f / 240, 0);
  const double height = ball.getWorldTransform().getOrigin().z();
  world.removeRigidBody(&ball);
  world.removeRigidBody(&ground);
  return height;
}
