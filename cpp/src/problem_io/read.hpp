#pragma once
// The parts of a problem file, each read by a file of its own.

#include <string>

#include "problem_io/json_node.hpp"

namespace energymargin::problem_io {

//! Throws std::invalid_argument if a file of `version` has a key that there is only `since` a later one.
void require_version(const JsonNode& node, const char* key, int since, int version);

Solid read_solid(const JsonNode& node);

//! Mesh files are looked for in `folder`; empty: there is none.
Shape read_shape(const JsonNode& node, const std::string& folder);

Scene read_scene(const JsonNode& node, int version, const std::string& folder);

//! A region on bodies of the scene.
Region read_region(const JsonNode& node, const Scene& scene);

//! A plan that fits the scene or, where there is none, one that may fit some scene.
Plan read_plan(const JsonNode& node, const Scene* scene);

//! The name of one of the scene's bodies.
std::string read_body_name(const JsonNode& node, const Scene& scene);

}  // namespace energymargin::problem_io
