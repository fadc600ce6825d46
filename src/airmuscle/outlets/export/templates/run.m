function r = run_@file@(file)
@provenance@%
% r = run_@file@() runs the scenario; run_@file@('run.csv') also writes the selected columns as CSV.
  model = @file@();
  r = model.simulate();
  if r.status ~= 0
    warning('the run ended at %.9g s with status %d: step too small (2), not finite (3) or beyond its range (5)', r.time, r.status);
  end
  if nargin > 0
    [found, columns] = ismember(@columns@, r.names);
    [out, message] = fopen(file, 'w');
    if out < 0
      error('%s: cannot be written to: %s', file, message);
    end
    fprintf(out, '%s\n', @header@);
    fprintf(out, [repmat('%.17g,', 1, sum(found) - 1), '%.17g\n'], r.data(:, columns)');
    fclose(out);
    if nargout == 0
      clear r % nothing is displayed
    end
  end
end
