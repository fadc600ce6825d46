function r = simulate(model, changes)
  run = model.run;
  run.parameters = model.defaults;
  if nargin > 1
    run = changed(run, changes);
  end
  s = begin_run(model, run);
  times = run.times(:);
  count = numel(times);
  data = zeros(count, 1 + numel(model.states) + numel(model.inputs) + numel(model.output_names));
  row = 1;
  status = 0;
  for k = 1:numel(run.ends)
    s = begin_segment(s, run.ends(k), run.values(k, :)', run.slopes(k, :)');
    [data, row] = write_rows(data, row, times, s.t + @close@, s);
    while s.t < s.finish && status == 0
      [s, status] = step(s);
      if status == 0 && s.t < s.finish
        [data, row] = write_rows(data, row, times, s.t + @close@, s);
      end
    end
    if status ~= 0
      break
    end
    % the row at the end of a segment has the inputs of the next one
    while row <= count && times(row) < s.finish - @close@
      [data, row] = write_rows(data, row, times, times(row), s);
    end
  end
  if status == 0
    [data, row] = write_rows(data, row, times, s.t + @close@, s);
  end
  r.names = [{'time'}, model.states, model.inputs, model.output_names];
  r.data = data(1:row - 1, :);
  r = ended(r, s, status);
end

function [data, row] = write_rows(data, row, times, limit, s)
  while row <= numel(times) && times(row) <= limit
    x = state_at(s, times(row));
    u = inputs_at(s, times(row));
    data(row, :) = [times(row); x; u; outputs(x, u, s.c)]';
    row = row + 1;
  end
end

