#pragma once
// All that a program needs to ask for a score; search/ has what it is searched with.

#include "energymargin/batch.hpp"
#include "energymargin/disturbances.hpp"
#include "energymargin/metrics/capture.hpp"
#include "energymargin/metrics/effort.hpp"
#include "energymargin/metrics/escape_energy.hpp"
#include "energymargin/metrics/force.hpp"
#include "energymargin/metrics/interval.hpp"
#include "energymargin/metrics/probability.hpp"
#include "energymargin/plan.hpp"
#include "energymargin/plausibility.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/problem_io.hpp"
#include "energymargin/scene.hpp"
#include "energymargin/state.hpp"
#include "energymargin/world.hpp"
