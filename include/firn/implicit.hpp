/// \file Umbrella header: implicit and quasi-static steps.
#pragma once

#include <firn/implicit/passes.hpp>
