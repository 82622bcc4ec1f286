/// \file Finds a minimum by L-BFGS, of the library LBFGS++.
#pragma once

#include <LBFGS.h>

#include <cstdio>
#include <exception>

namespace example {

/// Moves x to where f(x, gradient) is smallest. It stops at a kink, where the search along a line finds nothing better,
/// and says so.
/// \param value  receives f(x)
template <class Function>
void minimise(const LBFGSpp::LBFGSParam<double>& settings, Function& f, Eigen::VectorXd& x, double& value) {
    LBFGSpp::LBFGSSolver<double> solver(settings);
    try {
        solver.minimize(f, x, value);
    } catch (const std::exception& stopped) {
        std::printf("the optimiser stopped: %s\n", stopped.what());
    }
}

}  // namespace example
