#include "physics/contacts/dispatcher.hpp"

#include "physics/contacts/box_contacts.hpp"
#include "physics/contacts/pair_contacts.hpp"
#include "physics/contacts/plane_contacts.hpp"
#include "physics/contacts/round_contacts.hpp"

namespace energymargin {
namespace {

// Small pools: a scene has few contacts, and every problem builds its simulation anew.
btDefaultCollisionConstructionInfo small_pools() {
  btDefaultCollisionConstructionInfo info;
  info.m_defaultMaxPersistentManifoldPoolSize = 128;
  info.m_defaultMaxCollisionAlgorithmPoolSize = 128;
  info.m_customCollisionAlgorithmMaxElementSize = contacts_size;
  return info;
}

}  // namespace

ContactDispatcher::ContactDispatcher(RoundAlgorithm round)
    : configuration_(small_pools()), dispatcher_(&configuration_) {
  use_plane_contacts(dispatcher_);
  use_box_contacts(dispatcher_);
  hull_contacts_.use_in(dispatcher_);
  if (round == RoundAlgorithm::exact) use_round_contacts(dispatcher_);
}

}  // namespace energymargin
