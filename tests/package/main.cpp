#include <firn/firn.hpp>

#include <iostream>
#include <string>

#ifdef CONSUMER_HDF5
#include <hdf5.h>
#endif

std::string version_in_other_unit();

int main() {
    const std::string version = std::to_string(firn::version_major) + "." + std::to_string(firn::version_minor) + "." +
                                std::to_string(firn::version_patch);
    if (version != EXPECTED_VERSION || version_in_other_unit() != version) {
        std::cerr << "version " << version << ", expected " EXPECTED_VERSION "\n";
        return 1;
    }
#ifdef CONSUMER_HDF5
    if (H5open() < 0) return 1;
#endif
    std::cout << "firn " << version << '\n';
}
