// Scores a problem file between two simulations of single-precision Bullet; prints what examples/01_capture.cpp does.

#include <cmath>
#include <energymargin/energymargin.hpp>
#include <iostream>

double resting_height();
