// MetricEngine over a scalar type, complete. Private to the engines' translation units.
#pragma once

#include "flipfree/conformal/engine/scalar_engine.h"
#include "flipfree/conformal/engine/scalar_engine_angles.h"
#include "flipfree/conformal/engine/scalar_engine_relax.h"
#include "flipfree/conformal/engine/scalar_engine_star.h"
