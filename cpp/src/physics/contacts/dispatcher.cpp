#include "physics/contacts/dispatcher.hpp"

#include "physics/contacts/pair_contacts.hpp"
#include "physics/contacts/plane_contacts.hpp"

namespace energymargin {
namespace {

// Small pools: a scene has few contacts, and every problem builds its simulation anew. Most of that is clearing them;
// what they have no room for is allocated on its own.
constexpr int pool_size = 32;

btDefaultCollisionConstructionInfo small_pools() {
  btDefaultCollisionConstructionInfo info;
  info.m_defaultMaxPersistentManifoldPoolSize = pool_size;
  info.m_defaultMaxCollisionAlgorithmPoolSize = pool_size;
  info.m_customCollisionAlgorithmMaxElementSize = contacts_size;
  return info;
}

}  // namespace

ContactDispatcher::ContactDispatcher() : configuration_(small_pools()), dispatcher_(&configuration_) {
  use_plane_contacts(dispatcher_);
  solid_contacts_.use_in(dispatcher_);
}

}  // namespace energymargin
