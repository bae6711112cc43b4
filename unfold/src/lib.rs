//! Unfolding: from profiles per area to particles per volume.
