/// \file Compiles what the module offers in one dimension and precision; each has an object file of its own, so that
/// they are compiled at the same time.
#include "offer.hpp"

#include <firn/any/run_of.hpp>

FIRN_COMPILE_OFFER(FIRN_PYTHON_DIMENSION, FIRN_PYTHON_PRECISION, python::Offered);
