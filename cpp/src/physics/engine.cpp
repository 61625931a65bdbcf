#include "physics/engine.hpp"

#include "physics/bullet/bullet_engine.hpp"
#include "physics/native/native_engine.hpp"

namespace energymargin {

std::unique_ptr<Engine> make_engine(const Scene& scene) {
  if (scene.stepping().engine == EngineKind::bullet) return std::make_unique<BulletEngine>(scene);
  return std::make_unique<NativeEngine>(scene);
}

}  // namespace energymargin
