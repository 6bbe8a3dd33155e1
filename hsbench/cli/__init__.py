"""The command line: parse, call one public function, print. One small file per command, no logic."""
