"""What ``hsbench.synth.people.bake`` needs: reading MakeHuman's data, surgery on meshes, and their simplification."""
